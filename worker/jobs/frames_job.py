"""What the kinds of jobs share that begin with the frames of a venue: decode, compute, draw, tell."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import cv2

from worker.calibration import records
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.records import EngineResult, StageTimings
from worker.compute_resources import ComputeResources
from worker.jobs.answers import Progress, Provenance
from worker.jobs.decoding import decode_frame
from worker.jobs.from_schemas import Picture, camera_with_ignored_areas, pitch_of
from worker.jobs.to_schemas import (
    PREVIEW_FRACTION,
    R,
    Solution,
    engine_failures,
    load_segmenter,
    progress_to_schema,
    provenance_of,
)

if TYPE_CHECKING:
    from service.schemas.venue import Camera as VenueCamera
    from service.schemas.venue import Venue
    from worker.jobs import inputs

A = TypeVar("A", bound=EngineResult)
Frames = Mapping[str, Sequence[Picture]]


@dataclass(frozen=True)
class EngineInputs:
    """What the engine is given: the pitch, the cameras at their stored poses, their decoded frames, and the network."""

    pitch: Field
    cameras: Sequence[Camera]
    frames: Frames
    network: Segmenter


@dataclass(frozen=True)
class JobPictures:
    """Pictures by name, and the names of those that can be drawn later."""

    pictures: dict[str, bytes]
    later: Sequence[str] = ()


def solve(
    venue: Venue | inputs.Venue,
    files: Mapping[str, Sequence[bytes]],
    options: dict[str, Any],
    means: ComputeResources,
    report: Callable[[Progress], None],
    engine: Callable[[EngineInputs, Callable[[records.Progress], None]], A],
    draw: Callable[[EngineInputs, A], JobPictures],
    tell: Callable[[A, StageTimings, Provenance, Sequence[str]], R],
    remember: Callable[[A], Mapping[str, dict[str, Any]]] = lambda _: {},
) -> Solution[R]:
    """Call the `engine` with what a venue and the files of its cameras hold, `draw` its answer and `tell` it.

    `options`: what was asked for, to be told of with the result, `seed` among it. What is told, too, is what had to be
    changed in frames. `remember`: the memories that the answer leaves, by camera. With or without a server around it.
    """
    segmenter = load_segmenter(means)
    cv2.setNumThreads(means.threads)
    spent = StageTimings()
    with spent.timed("decode"):
        frames, warnings = _decode(venue, files, means.threads)
    cameras = [camera_with_ignored_areas(camera, camera.ignore) for camera in venue.cameras]
    given = EngineInputs(pitch_of(venue.field), cameras, frames, segmenter)
    with engine_failures():
        answer = engine(given, lambda step: report(progress_to_schema(step)))
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    spent.add(answer.timings)
    with spent.timed("preview"):
        drawn = draw(given, answer)
    provenance = provenance_of(means, segmenter, options.get("seed") or 0, options)
    result = tell(answer, spent, provenance, warnings)
    return Solution(result, drawn.pictures, drawn.later, remember(answer))


def _decode(
    venue: Venue | inputs.Venue, files: Mapping[str, Sequence[bytes]], threads: int
) -> tuple[Frames, Sequence[str]]:
    """The frames of each camera, several at once: one is decoded on one core. And what is to be told of them, once."""
    remarks: list[str] = []

    def decode(camera: VenueCamera | inputs.Camera, file: bytes) -> Picture:
        return decode_frame(camera.id, camera.image_size, file, remarks.append)

    with ThreadPoolExecutor(threads) as pool:
        decoding = {
            camera.id: [pool.submit(decode, camera, file) for file in files[camera.id]] for camera in venue.cameras
        }
        frames = {camera: [one.result() for one in several] for camera, several in decoding.items()}
    return frames, sorted({*remarks})
