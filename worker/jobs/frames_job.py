"""What the kinds of jobs share that begin with the frames of a venue: decode, compute, draw, tell."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from service.schemas.job import Progress
from service.schemas.options import FieldOptions, Options
from service.schemas.results import Provenance
from service.schemas.venue import Venue
from worker.calibration import records
from worker.calibration.detection.segmentation import Region, Segmenter
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.records import CalibrationError, EngineResult, StageTimings
from worker.jobs.from_schemas import JobFailedError, Picture, camera_with_ignored_areas, decode_frame, pitch_of
from worker.jobs.to_schemas import PREVIEW_FRACTION, R, Solution, load_segmenter, progress_to_schema, provenance_of
from worker.protocol import ComputeResources

A = TypeVar("A", bound=EngineResult)
Frames = Mapping[str, Sequence[Picture]]


class RecordingSegmenter:
    """A network that remembers what it said of the first frame of each camera.

    When it has seen all frames it is released, and whenever it has seen one again: search, judgement and pictures come
    after, and need as much memory.
    """

    def __init__(self, segmenter: Segmenter, frames: Frames) -> None:
        self._segmenter = segmenter
        self._unseen = sum(len(several) for several in frames.values())
        self._cameras = {id(several[0]): camera for camera, several in frames.items()}
        self.responses: dict[str, NDArray[np.uint8]] = {}

    def __call__(self, frame: Picture, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """As the network that is asked."""
        response = self._segmenter(frame, regions)
        self._unseen -= 1
        if self._unseen <= 0:
            self._segmenter.release()
        if id(frame) in self._cameras:
            self.responses[self._cameras[id(frame)]] = response
        return response


@dataclass(frozen=True)
class EngineInputs:
    """What the engine is given: the pitch, the cameras at their stored poses, their decoded frames, and the network."""

    pitch: Field
    cameras: Sequence[Camera]
    frames: Frames
    network: RecordingSegmenter


@dataclass(frozen=True)
class JobPictures:
    """Pictures by name, and the names of those that can be drawn later."""

    pictures: dict[str, bytes]
    later: Sequence[str] = ()


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options | FieldOptions,
    means: ComputeResources,
    report: Callable[[Progress], None],
    engine: Callable[[EngineInputs, Callable[[records.Progress], None]], A],
    draw: Callable[[EngineInputs, A], JobPictures],
    tell: Callable[[A, StageTimings, Provenance], R],
    remember: Callable[[A], Mapping[str, dict[str, Any]]] = lambda _: {},
) -> Solution[R]:
    """Call the `engine` with what a venue and the files of its cameras hold, `draw` its answer and `tell` it.

    `remember`: the memories that the answer leaves, by camera. With or without a server around it.
    """
    segmenter = load_segmenter(means)
    cv2.setNumThreads(means.threads)
    spent = StageTimings()
    with spent.timed("decode"):
        frames = {c.id: [decode_frame(c.id, c.image_size, file) for file in files[c.id]] for c in venue.cameras}
    cameras = [camera_with_ignored_areas(camera, camera.ignore) for camera in venue.cameras]
    given = EngineInputs(pitch_of(venue.field), cameras, frames, RecordingSegmenter(segmenter, frames))
    try:
        answer = engine(given, lambda step: report(progress_to_schema(step)))
    except CalibrationError as error:
        raise JobFailedError(error.kind, error.detail, error.camera) from error
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    spent.add(answer.timings)
    with spent.timed("preview"):
        drawn = draw(given, answer)
    # Who is told changes no number, and the address may be a secret.
    asked = options.model_dump(mode="json", exclude={"callback_url"})
    result = tell(answer, spent, provenance_of(segmenter, options.seed or 0, asked))
    return Solution(result, drawn.pictures, drawn.later, remember(answer))
