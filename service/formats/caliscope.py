"""Caliscope's camera_array.toml: a table `cameras.N` for each camera.

Camera and lens are OpenCV's (`fisheye`: `cv2.fisheye`); rotation, a Rodrigues vector or in older files a matrix, and
translation take the world to the camera. Cameras have numbers and no names; the world is that of the board, in metres.
"""

from collections.abc import Sequence
from typing import Any

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.parsing import ParsedFile
from service.formats.pose2sim import read_table, write_tables
from service.formats.records import CameraRecord


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return a table for each camera, numbered from 1 in the order of the venue."""
    return write_tables({f"cameras.{camera.number}": _members(camera) for camera in cameras})


def _members(camera: NumberedCamera) -> dict[str, Any]:
    if not camera.is_fisheye:
        camera.require_support("caliscope", COEFFICIENTS)
    members: dict[str, Any] = {
        "cam_id": camera.number,
        "size": list(camera.size),
        "rotation_count": 0,
        "ignore": False,
        "fisheye": camera.is_fisheye,
        "matrix": [[float(value) for value in row] for row in camera.intrinsics.matrix],
        "distortions": camera.distortion,
    }
    if camera.has_pose:
        members |= {"rotation": camera.pose.rotation, "translation": camera.pose.translation}
    return members


def recognises(file: ParsedFile) -> bool:
    """True for TOML with a table of cameras."""
    return file.kind == "toml" and "cameras" in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras that have a lens."""
    return [read_table(f"cam-{name}", table) for name, table in file.top["cameras"].members() if "matrix" in table]
