"""The short way: cameras that stand almost where they stood are found without a search.

The finish catches lines that are a few pixels from where stored poses expect them, and ends where it ends after a
search. What it finds has to pass the same gate. That is asked camera by camera: one that was turned is searched for,
one that is fogged is left, and the others need not be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worker.calibration.finish.diagnosis import is_sure
from worker.calibration.finish.refinement import SEARCH_PX, LineReader
from worker.calibration.finish.uncertainty import Finished
from worker.calibration.judge.quality import CameraResult
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.see.line_measurement import Measurements
from worker.calibration.settle import Settled, Situation, left_alone

LEAST_CAUGHT = 0.6
"""Share of the expected lines that the finish has to catch from the stored pose to be worth its time."""
FARTHEST_PX = 12.0
"""How far the visible lines may have moved on average, in pixels of a 4K frame: within what the finish catches."""


@dataclass(frozen=True)
class Nearby:
    """Cameras that were found near their stored poses: which `numbers` they are, and where the finish of them all
    left them, each judged by itself in `results`."""

    numbers: list[int]
    finished: Finished
    results: list[CameraResult]

    @property
    def cameras(self) -> dict[int, Camera]:
        """Where they stand, by number."""
        return {n: result.camera for n, result in zip(self.numbers, self.results, strict=True)}

    def settled(self, here: Situation) -> Settled:
        """The end of a calibration of which these are all cameras that can be used; the others stay as they are."""
        results = dict(zip(self.numbers, self.results, strict=True))
        for n in range(len(here.cameras)):
            if n not in results:
                results[n] = left_alone(here.of([n])).result
        in_order = [results[n] for n in range(len(here.cameras))]
        begun = list(here.cameras)
        return Settled(self.finished.pitch, begun, in_order, self.numbers, self.finished.deviations, generations=0)


def found_nearby(here: Situation) -> Nearby | None:
    """The cameras that are found without a search; None where there are none."""
    if not here.method.tries_again:
        return None
    reader = here.seen.sight.reader()
    numbers = _caught(here, reader)
    while numbers:
        group = here.of(numbers)
        finished = group.finished_nearby(reader.of(numbers))
        results = group.judged(finished)
        stayed = [n for n, result in zip(numbers, results, strict=True) if _stayed(result, here.options.lens_may_drift)]
        if stayed == numbers:
            return Nearby(numbers, finished, results)
        # Those that have not may have pulled at the others, which are asked once more without them.
        numbers = stayed
    return None


def _caught(here: Situation, reader: LineReader) -> list[int]:
    """The cameras that see most of their lines near enough to where their stored poses expect them."""
    lines = here.pitch.line_points()
    usable = here.usable
    cameras = [here.cameras[n] for n in usable]
    caught = reader.of(usable).measure(lines, cameras, SEARCH_PX[0])
    return [
        n
        for n, camera, found in zip(usable, cameras, caught, strict=True)
        if _share_caught(SeenLines.from_camera(lines, camera), found) >= LEAST_CAUGHT
    ]


def _share_caught(expected: SeenLines, found: Measurements) -> float:
    """Of the expected length that was measured, 0..1: lines thinner than a pixel count as what there is of them."""
    weight = expected.length_px * np.minimum(expected.width_px, 1.0)
    return float(np.sum(weight[np.isin(expected.index, found.index)]) / max(np.sum(weight), 1e-12))


def _stayed(result: CameraResult, lens_may_drift: bool) -> bool:
    """Whether a camera passes the gate by itself, has hardly moved, and has no zoom that is to be followed."""
    farthest_px = FARTHEST_PX * result.camera.intrinsics.relative_size
    zoomed = lens_may_drift and result.zoom is not None and is_sure(result.zoom)
    return result.accepted and not zoomed and result.moved.pixels <= farthest_px
