"""Cases of your own frames, whose cameras some calibration knows: one `keep` and one `find` of each.

The calibration is taken for the truth: it may be of any format that `esc convert` reads, in metres from the middle of
the field. Datasets have licences of their own; nothing of them is part of this bench.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fccb.making import STARTS, Made, Taken, known_camera, write_case
from benchmarks.fccb.sets import CaseSet
from demo.render import outdated
from service.formats.reading import read_paths
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import PosedCamera
from worker.calibration.geometry.camera import Camera
from worker.jobs.from_schemas import camera_of, pitch_of


def import_frames(
    cases: CaseSet, name: str, field: Mapping[str, object], calibration: Sequence[Path], frames: Mapping[str, Path]
) -> None:
    """Add two cases of each camera that has a frame; `field`: its template, and sizes that differ."""
    pitch = pitch_of(FieldOfPlay.model_validate(field))
    for record in read_paths(list(calibration)).with_frames(list(frames)):
        picture = cv2.imread(str(frames[record.id]), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        if picture is None or record.pose is None:
            raise SystemExit(f"camera {record.id}: expected a picture and a pose, one of them cannot be read")
        frame = np.asarray(picture, np.uint8)
        posed = PosedCamera(
            id=record.id,
            image_size=[frame.shape[1], frame.shape[0]],
            intrinsics=record.intrinsics,
            pose=record.pose,
        )
        real = camera_of(posed)
        rng = np.random.default_rng(zlib.crc32(f"{name} {record.id}".encode()))
        stored = real.with_pose(outdated(real.pose, *STARTS["touched"], rng))
        for task, known in (("keep", known_camera(stored)), ("find", _without_pose(real))):
            made = Made(str(field["template"]), pitch, pitch, [known], [[Taken(real, frame)]])
            write_case(cases, f"{task}-{name}-{record.id}", task, made)


def _without_pose(camera: Camera) -> dict[str, object]:
    return {name: value for name, value in known_camera(camera).items() if name != "pose"}
