"""SoccerNet's camera JSON (sn-calibration, `Camera.from_json_parameters`): pan, tilt and roll, one camera a file.

World: x as here, y towards the near side, z down. Orientation (camera to world) = Rz(pan) Rx(tilt) Rz(roll); with
tilt 0 a camera looks straight down. Readers take the picture to be twice as large as the principal point says: so it is
read, where that is a whole number of pixels. `cam_params` around the parameters, as other tools write it, is read too.
"""

import json
import math

from service.formats.lens import RADIAL, TANGENTIAL, THIN_PRISM, NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of, stem_of
from service.formats.rotations import Matrix, product, rotation_about, transposed, vector_of
from service.schemas.geometry import Pose


def write(camera: NumberedCamera) -> bytes:
    """Return the parameters of a camera: pixels, degrees, metres."""
    camera.require_support("soccernet", {*RADIAL, *TANGENTIAL, *THIN_PRISM})
    # y and z turn round: half a turn about x.
    orientation = transposed([[right, -down, -ahead] for right, down, ahead in camera.rotation])
    pan, tilt, roll = (math.degrees(angle) for angle in _pan_tilt_roll(orientation))
    x, y, z = camera.pose.position
    (fx, fy), k = camera.focal, camera.coefficients
    parameters = {
        "pan_degrees": pan,
        "tilt_degrees": tilt,
        "roll_degrees": roll,
        "position_meters": [x, -y, -z],
        "x_focal_length": fx,
        "y_focal_length": fy,
        "principal_point": list(camera.principal),
        "radial_distortion": [k[name] for name in RADIAL],
        "tangential_distortion": [k[name] for name in TANGENTIAL],
        "thin_prism_distortion": [k[name] for name in THIN_PRISM],
    }
    return (json.dumps(parameters, indent=2) + "\n").encode()


def _pan_tilt_roll(o: Matrix) -> tuple[float, float, float]:
    """Return the z-x-z angles, in radians, of an orientation (3, 3)."""
    level = math.hypot(o[2][0], o[2][1])
    tilt = math.atan2(level, o[2][2])
    if level == 0:
        # Straight down or up: pan and roll turn about the same axis; the pan takes it all.
        return math.atan2(o[1][0], o[0][0]), tilt, 0.0
    pan = math.atan2(o[0][2], -o[1][2])
    # What is left: nearly straight down, pan and roll are hardly known one by one, but well together.
    left = product(transposed(product(rotation_about("z", pan), rotation_about("x", tilt))), o)
    return pan, tilt, math.atan2(left[1][0], left[0][0])


def recognises(file: ParsedFile) -> bool:
    """True for an object with pan and tilt in degrees."""
    return file.kind == "json" and "pan_degrees" in _parameters(file.top)


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the camera of a file, named as the file."""
    node = _parameters(file.top)
    pan, tilt, roll = (math.radians(node[f"{name}_degrees"].number()) for name in ("pan", "tilt", "roll"))
    orientation = product(product(rotation_about("z", pan), rotation_about("x", tilt)), rotation_about("z", roll))
    rotation = [[right, -down, -ahead] for right, down, ahead in transposed(orientation)]
    x, y, z = node["position_meters"].numbers(3)
    centre = node["principal_point"].numbers(2)
    matrix = camera_matrix(node["x_focal_length"].number(), node["y_focal_length"].number(), *centre)
    (k1, k2, *others), (p1, p2), prism = (
        node[f"{name}_distortion"].numbers(count) if f"{name}_distortion" in node else [0.0] * count
        for name, count in (("radial", 6), ("tangential", 2), ("thin_prism", 4))
    )
    coefficients = [k1, k2, p1, p2, *others, *prism]
    while coefficients and coefficients[-1] == 0:
        coefficients.pop()
    width, height = (2 * value for value in centre)
    size = (int(width), int(height)) if width.is_integer() and height.is_integer() else None
    pose = Pose.from_position(vector_of(rotation), [x, -y, -z])
    return [CameraRecord(stem_of(file.name), lens_of(node, matrix, coefficients), size, pose)]


def _parameters(top: Node) -> Node:
    return top.get("cam_params") or top
