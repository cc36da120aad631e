"""Pose2Sim's and aniposelib's TOML: one file with a table for each camera, as anipose reads and Caliscope exports it.

Their camera is OpenCV's (`cv2.projectPoints`), their world is metres with z up, as ours. `fisheye` is in the file, but
Pose2Sim does not read it: a fisheye lens is refused. Files that have it, of anipose, are read.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, lens_of
from service.formats.rotations import pose_from_translation, read_rotation


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return a table for each camera, `cam_01` for the first of the venue; `name` is the camera's id.

    Ids are not the tables' names: readers sort these, and take `metadata` or `charuco` for something else.
    """
    return write_tables({f"cam_{camera.number:02}": _members(camera) for camera in cameras})


def _members(camera: NumberedCamera) -> dict[str, Any]:
    camera.require_support("pose2sim", COEFFICIENTS)
    return {
        "name": camera.id,
        "size": list(camera.size),
        "matrix": [[float(value) for value in row] for row in camera.intrinsics.matrix],
        "distortions": camera.distortion,
        "rotation": [float(value) for value in camera.pose.rotation],
        "translation": [float(value) for value in camera.pose.translation],
        "fisheye": False,
    }


def write_tables(tables: Mapping[str, Mapping[str, Any]]) -> bytes:
    """Return TOML of tables by their names; texts without escapes, numbers, booleans and arrays are as in JSON."""
    lines: list[str] = []
    for name, members in tables.items():
        lines += [f"[{name}]", *(f"{member} = {json.dumps(value)}" for member, value in members.items()), ""]
    return "\n".join(lines).encode()


def recognises(file: ParsedFile) -> bool:
    """True for TOML with a table that has a matrix."""
    return file.kind == "toml" and any("matrix" in table for _, table in file.top.members())


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras of all tables that have a matrix: `metadata` and the like have none."""
    return [read_table(name, table) for name, table in file.top.members() if "matrix" in table]


def read_table(name: str, table: Node) -> CameraRecord:
    """Return the camera of a table; rotation, a vector or a matrix, and translation may be missing."""
    named, size, distortion, fisheye = (table.get(key) for key in ("name", "size", "distortions", "fisheye"))
    lens = lens_of(
        table,
        table["matrix"].matrix(3, 3),
        [] if distortion is None else distortion.numbers(),
        "fisheye" if fisheye and fisheye.flag() else "opencv",
    )
    pose = None
    if "rotation" in table and "translation" in table:
        pose = pose_from_translation(read_rotation(table["rotation"]), table["translation"].numbers(3))
    return CameraRecord(named.text() if named else name, lens, None if size is None else size.size(), pose)
