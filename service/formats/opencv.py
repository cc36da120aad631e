"""OpenCV's FileStorage YAML: what `cv::calibrateCamera`'s users and `cv2.FileStorage` read, one camera a file.

The header is that of OpenCV 4: 4.x and 5.x both read it (5.x itself writes `%YAML 1.2`).
"""

from __future__ import annotations

from collections.abc import Sequence

from service.formats.lens import COEFFICIENTS, NumberedCamera

# FileStorage has no empty matrices; five zeros are what OpenCV itself takes for no distortion.
NO_DISTORTION = [0.0] * 5


def write(shot: NumberedCamera) -> bytes:
    """Return image size, camera matrix, distortion in OpenCV's order, rvec and tvec (world to camera, m)."""
    shot.require_support(
        "opencv", COEFFICIENTS
    )  # its matrix could hold a skew, but `cv2.projectPoints` does not read it
    camera = shot.camera
    width, height = shot.size
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {width}",
        f"image_height: {height}",
        *_matrix("camera_matrix", camera.intrinsics.matrix),
        *_matrix("distortion_coefficients", [camera.intrinsics.distortion or NO_DISTORTION]),
        *_matrix("rvec", [[value] for value in camera.pose.rotation]),
        *_matrix("tvec", [[value] for value in camera.pose.translation]),
    ]
    return "\n".join([*lines, ""]).encode()


def _matrix(name: str, rows: Sequence[Sequence[float]]) -> list[str]:
    data = ", ".join(repr(float(value)) for row in rows for value in row)
    return [
        f"{name}: !!opencv-matrix",
        f"   rows: {len(rows)}",
        f"   cols: {len(rows[0])}",
        "   dt: d",
        f"   data: [ {data} ]",
    ]
