"""Pose2Sim's and aniposelib's TOML: one file with a table for each camera, as anipose reads and Caliscope exports it.

Their camera is OpenCV's (`cv2.projectPoints`), their world is metres with z up, as ours. `fisheye` is in the file, but
Pose2Sim does not read it: a fisheye lens is refused. Files that have it, of anipose, are read.
"""

import json
from collections.abc import Sequence

from service.formats.lens import COEFFICIENTS, NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, lens_of
from service.formats.rotations import pose_from_translation, read_rotation

# Readers hand the coefficients to OpenCV as they are, and it takes no fewer than four.
NO_DISTORTION = [0.0] * 5


def write(shots: Sequence[NumberedCamera]) -> bytes:
    """Return a table for each camera, `cam_01` for the first of the venue; `name` is the camera's id.

    Ids are not the tables' names: readers sort these, and take `metadata` or `charuco` for something else.
    """
    return "\n".join(line for shot in shots for line in [*_table(shot), ""]).encode()


def _table(shot: NumberedCamera) -> list[str]:
    shot.require_support("pose2sim", COEFFICIENTS)
    intrinsics, pose = shot.camera.intrinsics, shot.pose
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
    sides = None if size is None else [side.integer(1) for side in size.elements(2)]
    return CameraRecord(named.text() if named else name, lens, None if sides is None else (sides[0], sides[1]), pose)
