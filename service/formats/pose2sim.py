"""Pose2Sim's and aniposelib's TOML: one file with a table for each camera, as anipose reads and Caliscope exports it.

Their camera is OpenCV's (`cv2.projectPoints`), their world is metres with z up, as ours. `fisheye` is in the file, but
Pose2Sim does not read it: a fisheye lens is refused.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from service.formats.lens import COEFFICIENTS, NumberedCamera

# Readers hand the coefficients to OpenCV as they are, and it takes no fewer than four.
NO_DISTORTION = [0.0] * 5


def write(shots: Sequence[NumberedCamera]) -> bytes:
    """Return a table for each camera, `cam_01` for the first of the venue; `name` is the camera's id.

    Ids are not the tables' names: readers sort these, and take `metadata` or `charuco` for something else.
    """
    return "\n".join(line for shot in shots for line in [*_table(shot), ""]).encode()


def _table(shot: NumberedCamera) -> list[str]:
    shot.require_support("pose2sim", COEFFICIENTS)
    intrinsics, pose = shot.camera.intrinsics, shot.camera.pose
    members = {
        "name": shot.id,
        "size": list(shot.size),
        "matrix": [[float(value) for value in row] for row in intrinsics.matrix],
        "distortions": [float(value) for value in intrinsics.distortion or NO_DISTORTION],
        "rotation": [float(value) for value in pose.rotation],
        "translation": [float(value) for value in pose.translation],
        "fisheye": False,
    }
    # Strings without escapes, numbers, booleans and arrays of them are the same in TOML as in JSON.
    return [f"[cam_{shot.number:02}]", *(f"{name} = {json.dumps(value)}" for name, value in members.items())]
