"""Caliscope's camera_array.toml: a table `cameras.N` for each camera.

Camera and lens are OpenCV's (`fisheye`: `cv2.fisheye`); rotation, a Rodrigues vector or in older files a matrix, and
translation take the world to the camera. Cameras have numbers and no names; the world is that of the board, in metres.
"""

import json
from collections.abc import Sequence
from typing import Any

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.parsing import ParsedFile
from service.formats.pose2sim import NO_DISTORTION, read_table
from service.formats.records import CameraRecord


def write(shots: Sequence[NumberedCamera]) -> bytes:
    """Return a table for each camera, numbered from 1 in the order of the venue."""
    return "\n".join(line for shot in shots for line in [*_table(shot), ""]).encode()


def _table(shot: NumberedCamera) -> list[str]:
    if not shot.is_fisheye:
        shot.require_support("caliscope", COEFFICIENTS)
    intrinsics = shot.camera.intrinsics
    members: dict[str, Any] = {
        "cam_id": shot.number,
        "size": list(shot.size),
        "rotation_count": 0,
        "ignore": False,
        "fisheye": shot.is_fisheye,
        "matrix": [[float(value) for value in row] for row in intrinsics.matrix],
        "distortions": shot.fisheye_coefficients if shot.is_fisheye else intrinsics.distortion or NO_DISTORTION,
    }
    if shot.has_pose:
        members |= {"rotation": shot.pose.rotation, "translation": shot.pose.translation}
    # Numbers, booleans and arrays of them are the same in TOML as in JSON.
    return [f"[cameras.{shot.number}]", *(f"{name} = {json.dumps(value)}" for name, value in members.items())]


def recognises(file: ParsedFile) -> bool:
    """True for TOML with a table of cameras."""
    return file.kind == "toml" and "cameras" in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras that have a lens."""
    return [read_table(f"cam-{name}", table) for name, table in file.top["cameras"].members() if "matrix" in table]
