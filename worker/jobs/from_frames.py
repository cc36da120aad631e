"""What the kinds of jobs share that begin with the frames of a venue: decode, compute, draw, tell."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from service.settings import Settings
from service.wire.job import Progress
from service.wire.options import FieldOptions, Options
from service.wire.results import Provenance
from service.wire.venue import Venue
from worker.calibration import records
from worker.calibration.records import Answer, CalibrationError, Segment
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.calibration.see.segmentation import Region
from worker.jobs.wire import (
    PREVIEW_FRACTION,
    Failure,
    Picture,
    R,
    Solution,
    decoded_frame,
    pitch_of,
    provenance_of,
    segmenter_of,
    to_the_millisecond,
    watching,
    wire_progress,
)

A = TypeVar("A", bound=Answer)
Frames = Mapping[str, Sequence[Picture]]


class Remembering:
    """A network that remembers what it said of the first frame of each camera."""

    def __init__(self, segment: Segment, frames: Frames) -> None:
        self._segment = segment
        self._cameras = {id(several[0]): camera for camera, several in frames.items()}
        self.responses: dict[str, NDArray[np.uint8]] = {}

    def __call__(self, frame: Picture, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """As the network that is asked."""
        response = self._segment(frame, regions)
        if id(frame) in self._cameras:
            self.responses[self._cameras[id(frame)]] = response
        return response


@dataclass(frozen=True)
class Given:
    """What the engine is given: the pitch, the cameras at their stored poses, their decoded frames, and the network."""

    pitch: Field
    cameras: Sequence[Camera]
    frames: Frames
    network: Remembering


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options | FieldOptions,
    settings: Settings,
    report: Callable[[Progress], None],
    engine: Callable[[Given, Callable[[records.Progress], None]], A],
    draw: Callable[[Given, A], dict[str, bytes]],
    tell: Callable[[A, Mapping[str, float], Provenance], R],
) -> Solution[R]:
    """Call the `engine` with what a venue and the files of its cameras hold, `draw` its answer and `tell` it.

    With or without a server around it.
    """
    segmenter = segmenter_of(settings)
    cv2.setNumThreads(settings.threads)
    begun = time.perf_counter()
    frames = {c.id: [decoded_frame(c.id, c.image_size, file) for file in files[c.id]] for c in venue.cameras}
    decoded = time.perf_counter()
    cameras = [watching(camera) for camera in venue.cameras]
    given = Given(pitch_of(venue.field), cameras, frames, Remembering(segmenter, frames))
    try:
        answer = engine(given, lambda step: report(wire_progress(step)))
    except CalibrationError as error:
        raise Failure(error.kind, error.detail, error.camera) from error
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    drawing = time.perf_counter()
    pictures = draw(given, answer)
    timings = {"decode": decoded - begun, **answer.timings_s, "preview": time.perf_counter() - drawing}
    return Solution(tell(answer, to_the_millisecond(timings), provenance_of(segmenter, options)), pictures)
