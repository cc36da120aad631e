"""State of the lines that a plan assumes, and the measurements that the line reader would make of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.detection.line_matching import filter_reach
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.visibility import VisibleLines

StateName = Literal["fresh", "worn", "night"]


@dataclass(frozen=True)
class LineState:
    """State of the lines: how much of them is measured, and how well.

    `measured`: share 0..1 of the points of a wide line that are measured, the rest being worn off or behind players;
    `width_px`: of lines that are measured half as often, because they are so thin in the picture; `misfit_px`: what a
    measurement is off by beyond its noise, alike over 10 px of line (`Measurements.misfit_px`).
    """

    measured: float
    width_px: float
    misfit_px: float

    def share(self, width_px: Array) -> Array:
        """Return the share (N,) of points measured on lines so wide in the picture, px."""
        return np.asarray(self.measured * width_px**2 / (width_px**2 + self.width_px**2), dtype=float)


STATES: Mapping[StateName, LineState] = {
    "fresh": LineState(0.9, 0.5, 0.3),
    "worn": LineState(0.6, 0.7, 0.4),
    "night": LineState(0.85, 0.6, 0.35),
}
"""States that `python -m benchmarks.planning` measured in rendered frames."""


def expect_measurements(lines: LinePoints, camera: Camera, state: LineState, hidden: float = 0.0) -> Measurements:
    """Return what the line reader is expected to measure of a camera's frame, each line where the camera puts it.

    `hidden`: share 0..1 of all lines that something covers, beyond the players of `state`. A point that is measured in
    half of all frames has half the trust in this one.
    """
    seen = VisibleLines.from_camera(lines, camera)
    # The whole of the matched filter has to lie in the picture.
    aside = filter_reach(seen.width_px)[:, None] * seen.normal
    seen = seen[camera.sees(seen.pixel + aside) & camera.sees(seen.pixel - aside)]
    return Measurements(
        seen.index,
        seen.points,
        seen.pixel,
        seen.normal,
        seen.px_per_metre,
        seen.px_per_metre_up,
        seen.length_px,
        (1 - hidden) * state.share(seen.width_px),
        state.misfit_px,
    )
