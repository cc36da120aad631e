"""Cases of frames whose cameras some calibration knows: one `keep` and one `find` of each frame.

The calibration is taken for the truth. Datasets have licences of their own; nothing of them is part of this bench.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fccb.datasets import DATASETS
from benchmarks.fccb.making import STARTS, Made, Taken, known_camera, write_case
from benchmarks.fccb.sets import CaseSet
from demo.render import outdated
from service.formats.reading import read_paths
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import PosedCamera
from worker.calibration.geometry.camera import Camera, Frame
from worker.jobs.from_schemas import camera_of, pitch_of


def import_frames(
    cases: CaseSet, name: str, field: FieldOfPlay, calibration: Sequence[Path], frames: Mapping[str, Path]
) -> None:
    """Add two cases of each camera that has a frame, by a calibration in metres from the middle of the field."""
    for record in read_paths(list(calibration)).with_frames(list(frames)):
        frame = _read(frames[record.id])
        if record.pose is None:
            raise SystemExit(f"camera {record.id}: expected a pose in the calibration, got none")
        height, width = frame.shape[:2]
        camera = PosedCamera(id=record.id, image_size=[width, height], intrinsics=record.intrinsics, pose=record.pose)
        _add(cases, f"{name}-{record.id}", field, camera_of(camera), frame)


def import_dataset(cases: CaseSet, name: str, field: FieldOfPlay, folder: Path, most: int) -> int:
    """Add two cases of each of `most` frames, evenly out of all that a dataset has, and return their number."""
    published = list(DATASETS[name].frames(folder, field))
    if not published:
        raise SystemExit(f"{folder}: expected pictures and cameras of {name}, found none (benchmarks/fccb/README.md)")
    steps = np.linspace(0, len(published) - 1, min(most, len(published))).round().astype(int)
    for one in [published[step] for step in steps]:
        frame = _read(one.picture)
        real = camera_of(one.camera).resized(frame.shape[1])
        if real.intrinsics.size != (size := (frame.shape[1], frame.shape[0])):
            raise SystemExit(f"{one.picture}: expected {real.intrinsics.size} pixels by its camera, got {size}")
        _add(cases, f"{name}-{one.name}"[:56], field, real, frame)
    return len(steps)


def _read(file: Path) -> Frame:
    picture = cv2.imread(str(file), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise SystemExit(f"{file}: expected a picture, got none that can be read")
    return np.asarray(picture, np.uint8)


def _add(cases: CaseSet, name: str, field: FieldOfPlay, real: Camera, frame: Frame) -> None:
    pitch = pitch_of(field)
    rng = np.random.default_rng(zlib.crc32(name.replace("-", " ").encode()))
    stored = real.with_pose(outdated(real.pose, *STARTS["touched"], rng))
    for task, known in (("keep", known_camera(stored)), ("find", _without_pose(real))):
        made = Made(field.template, pitch, pitch, [known], [[Taken(real, frame)]])
        write_case(cases, f"{task}-{name}", task, made)


def _without_pose(camera: Camera) -> dict[str, object]:
    return {name: value for name, value in known_camera(camera).items() if name != "pose"}
