"""The short way: cameras that stand almost where they stood are found without a search.

The finish catches lines that are a few pixels from where stored poses expect them, and ends where it ends after a
search. What it finds has to pass the same gate; whatever does not is searched for as if nobody had looked here first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from worker.calibration.finish.diagnosis import is_sure
from worker.calibration.finish.refinement import SEARCH_PX
from worker.calibration.judge.quality import CameraResult
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import LinePoints
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.see.line_measurement import Measurements
from worker.calibration.settle import Settled, Situation

LEAST_CAUGHT = 0.6
"""Share of the expected lines that the finish has to catch from the stored pose to be worth its time."""
FARTHEST_PX = 12.0
"""How far the visible lines may have moved on average, in pixels of a 4K frame: within what the finish catches."""


def settle_nearby(here: Situation) -> Settled | None:
    """Where the cameras ended without a search; None where one of them has to be searched for."""
    everyone = list(range(len(here.cameras)))
    if not here.method.tries_again or here.usable != everyone:
        return None
    lines = here.pitch.line_points()
    reader = here.seen.sight.reader()
    if not _all_caught(lines, here.cameras, reader.measure(lines, here.cameras, SEARCH_PX[0])):
        return None
    finished = here.finished_nearby(reader)
    results = here.judged(finished)
    if not all(_stayed(result, here.options.lens_may_drift) for result in results):
        return None
    return Settled(finished.pitch, list(here.cameras), results, everyone, finished.deviations, generations=0)


def _all_caught(lines: LinePoints, cameras: Sequence[Camera], caught: Sequence[Measurements]) -> bool:
    """Whether every camera sees most of its lines near enough to where its stored pose expects them."""
    return all(
        _share_caught(SeenLines.from_camera(lines, camera), found) >= LEAST_CAUGHT
        for camera, found in zip(cameras, caught, strict=True)
    )


def _share_caught(expected: SeenLines, found: Measurements) -> float:
    """Of the expected length that was measured, 0..1: lines thinner than a pixel count as what there is of them."""
    weight = expected.length_px * np.minimum(expected.width_px, 1.0)
    return float(np.sum(weight[np.isin(expected.index, found.index)]) / max(np.sum(weight), 1e-12))


def _stayed(result: CameraResult, lens_may_drift: bool) -> bool:
    """Whether a camera passes the gate by itself, has hardly moved, and has no zoom that is to be followed."""
    farthest_px = FARTHEST_PX * result.camera.intrinsics.relative_size
    zoomed = lens_may_drift and result.zoom is not None and is_sure(result.zoom)
    return result.accepted and not zoomed and result.moved.pixels <= farthest_px
