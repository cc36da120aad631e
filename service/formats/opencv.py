"""OpenCV's FileStorage: what `cv::calibrateCamera`'s users and `cv2.FileStorage` read, one camera a file.

Written as YAML, with the header of OpenCV 4: 4.x and 5.x both read it (5.x itself writes `%YAML 1.2`). Read as YAML,
XML and JSON, under the names that OpenCV's own samples and most of its users give the parts. A fisheye has
`fisheye_model: 1`, as the samples write it. `rvec` and `tvec` (or a matrix R and T) take the world to the camera.
"""

import math
from collections.abc import Sequence

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, lens_of, stem_of
from service.formats.rotations import pose_from_translation, read_rotation

MATRIX_NAMES = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsic_matrix", "K")
DISTORTION_NAMES = (
    "distortion_coefficients",
    "distCoeffs",
    "dist_coeffs",
    "Distortion_Coefficients",
    "distortion",
    "D",
)
ROTATION_NAMES, TRANSLATION_NAMES = ("rvec", "rotation", "R"), ("tvec", "translation", "T")
WIDTH_NAMES, HEIGHT_NAMES = ("image_width", "image_Width"), ("image_height", "image_Height")


def write(camera: NumberedCamera) -> bytes:
    """Return image size, camera matrix, distortion in OpenCV's order, rvec and tvec (world to camera, m)."""
    if not camera.is_fisheye:
        # Its matrix could hold a skew, but `cv2.projectPoints` does not read it.
        camera.require_support("opencv", COEFFICIENTS)
    width, height = camera.size
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {width}",
        f"image_height: {height}",
        *_matrix("camera_matrix", camera.intrinsics.matrix),
        *(["fisheye_model: 1"] if camera.is_fisheye else []),
        *_matrix("distortion_coefficients", [camera.distortion]),
    ]
    if camera.has_pose:
        lines += _matrix("rvec", [[value] for value in camera.pose.rotation])
        lines += _matrix("tvec", [[value] for value in camera.pose.translation])
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


def recognises(file: ParsedFile) -> bool:
    """True for a matrix with rows and columns under one of the names, unless it is ROS's."""
    if file.kind not in ("yaml", "xml", "json"):
        return False
    matrix = _any_of(file.top, MATRIX_NAMES)
    return matrix is not None and "rows" in matrix and "data" in matrix and "distortion_model" not in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the camera of a file, named as the file."""
    top = file.top
    matrix = _any_of(top, MATRIX_NAMES) or top["camera_matrix"]
    distortion, rotation, translation, width, height = (
        _any_of(top, names)
        for names in (DISTORTION_NAMES, ROTATION_NAMES, TRANSLATION_NAMES, WIDTH_NAMES, HEIGHT_NAMES)
    )
    coefficients = [] if distortion is None else _data(distortion).numbers()
    fisheye = top.get("fisheye_model")
    lens = lens_of(
        matrix, _data(matrix).matrix(3, 3), coefficients, "fisheye" if fisheye and fisheye.flag() else "opencv"
    )
    size = None if width is None or height is None else (width.integer(1), height.integer(1))
    pose = None
    if rotation is not None and translation is not None:
        pose = pose_from_translation(read_rotation(_data(rotation)), _data(translation).numbers(3))
    return [CameraRecord(stem_of(file.name), lens, size, pose)]


def _any_of(node: Node, names: Sequence[str]) -> Node | None:
    return next((node[name] for name in names if name in node), None)


def _data(node: Node) -> Node:
    """Return the numbers of a matrix, row by row; they are a plain list where the file has no matrix."""
    if not isinstance(node.value, dict):
        return node
    # OpenCV 5 writes a vector with `sizes`, not as a column.
    sides = node["sizes"].elements() if "sizes" in node else [node["rows"], node["cols"]]
    data = node["data"]
    data.numbers(math.prod(side.integer(1) for side in sides))
    return data
