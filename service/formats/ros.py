"""ROS's camera_info YAML (camera_calibration_parsers): the lens of one camera a file, without a pose.

Lenses: `plumb_bob` (k1, k2, p1, p2, k3), `rational_polynomial` (with k4 to k6) and `equidistant` (`cv2.fisheye`). Pixel
centres are at integers. The camera is monocular: its rectification is the identity. Dumps of the message
`sensor_msgs/CameraInfo` (`D`, `K`, or `d`, `k` of ROS 2) are read too.
"""

from collections.abc import Sequence

from service.formats.lens import RADIAL, TANGENTIAL, NumberedCamera
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, lens_of, stem_of
from service.schemas.names import LensModel

MODELS: dict[str, LensModel] = {
    "plumb_bob": "opencv",
    "rational_polynomial": "opencv",
    "equidistant": "fisheye",
    "fisheye": "fisheye",
}


def write(camera: NumberedCamera) -> bytes:
    """Return the lens of a camera."""
    if camera.is_fisheye:
        model, coefficients = "equidistant", camera.distortion
    else:
        camera.require_support("ros", {*RADIAL, *TANGENTIAL})
        k = camera.coefficients
        is_rational = any(k[name] for name in ("k4", "k5", "k6"))
        model = "rational_polynomial" if is_rational else "plumb_bob"
        coefficients = [*k.values()][: 8 if is_rational else 5]
    matrix = camera.intrinsics.matrix
    width, height = camera.size
    lines = [
        f"image_width: {width}",
        f"image_height: {height}",
        f"camera_name: {camera.id}",
        *_matrix("camera_matrix", matrix),
        f"distortion_model: {model}",
        *_matrix("distortion_coefficients", [coefficients]),
        *_matrix("rectification_matrix", [[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        *_matrix("projection_matrix", [[*row, 0] for row in matrix]),
    ]
    return "\n".join([*lines, ""]).encode()


def _matrix(name: str, rows: Sequence[Sequence[float]]) -> list[str]:
    data = ", ".join(repr(float(value)) for row in rows for value in row)
    return [f"{name}:", f"  rows: {len(rows)}", f"  cols: {len(rows[0])}", f"  data: [{data}]"]


def recognises(file: ParsedFile) -> bool:
    """True for YAML that names a distortion model beside a camera matrix."""
    return (
        file.kind == "yaml"
        and "distortion_model" in file.top
        and any(name in file.top for name in ("camera_matrix", "K", "k"))
    )


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the camera of a file, by its name in it."""
    top, model = file.top, file.top["distortion_model"]
    if model.value not in MODELS:
        model.refuse(f"one of {', '.join(MODELS)}")
    if "camera_matrix" in top:
        matrix, coefficients = top["camera_matrix"]["data"], top["distortion_coefficients"]["data"]
        size = top["image_width"].integer(1), top["image_height"].integer(1)
    else:
        matrix, coefficients = (top[name if name in top else name.lower()] for name in "KD")
        size = top["width"].integer(1), top["height"].integer(1)
    lens = lens_of(top, matrix.matrix(3, 3), coefficients.numbers(), MODELS[model.value])
    name = top.get("camera_name")
    return [CameraRecord(stem_of(file.name) if name is None else str(name.value), lens, size)]
