"""SoccerNet's camera JSON (sn-calibration, `Camera.from_json_parameters`): pan, tilt and roll, one camera a file.

World: x as here, y towards the near side, z down. Orientation (camera to world) = Rz(pan) Rx(tilt) Rz(roll); with
tilt 0 a camera looks straight down. Readers take the picture to be twice as large as the principal point says.
"""

from __future__ import annotations

import json
import math

from service.formats.lens import RADIAL, TANGENTIAL, THIN_PRISM, Matrix, NumberedCamera, transposed


def write(shot: NumberedCamera) -> bytes:
    """Return the parameters of a camera: pixels, degrees, metres."""
    shot.require_support("soccernet", {*RADIAL, *TANGENTIAL, *THIN_PRISM})
    # y and z turn round: half a turn about x.
    orientation = transposed([[right, -down, -ahead] for right, down, ahead in shot.rotation])
    pan, tilt, roll = (math.degrees(angle) for angle in _pan_tilt_roll(orientation))
    x, y, z = shot.camera.pose.position
    (fx, fy), k = shot.focal, shot.coefficients
    parameters = {
        "pan_degrees": pan,
        "tilt_degrees": tilt,
        "roll_degrees": roll,
        "position_meters": [x, -y, -z],
        "x_focal_length": fx,
        "y_focal_length": fy,
        "principal_point": list(shot.principal),
        "radial_distortion": [k[name] for name in RADIAL],
        "tangential_distortion": [k[name] for name in TANGENTIAL],
        "thin_prism_distortion": [k[name] for name in THIN_PRISM],
    }
    return (json.dumps(parameters, indent=2) + "\n").encode()


def _pan_tilt_roll(o: Matrix) -> tuple[float, float, float]:
    """Return the z-x-z angles, in radians, of an orientation (3, 3)."""
    level = math.hypot(o[2][0], o[2][1])
    tilt = math.atan2(level, o[2][2])
    if level < 1e-9:
        # Straight down or up: pan and roll turn about the same axis; the pan takes it all.
        return math.atan2(o[1][0], o[0][0]), tilt, 0.0
    return math.atan2(o[0][2], -o[1][2]), tilt, math.atan2(o[2][0], o[2][1])
