"""State of the lines that a plan assumes, and the measurements that the line reader would make of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.detection.line_matching import WIDTH_CLASSES_PX, filter_reach
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.visibility import VisibleLines

StateName = Literal["fresh", "worn", "night"]


@dataclass(frozen=True)
class LineState:
    """State of the lines: how much of them is measured, and how much of that is news.

    `measured`: share 0..1 of the points of lines in view that are measured, the rest being worn off or behind players;
    `alike`: number of neighbouring points (25 cm apart) whose errors are the same, by the brush, wear and the ground
    below, so that they count as one.
    """

    measured: float
    alike: float


STATES: Mapping[StateName, LineState] = {
    "fresh": LineState(0.92, 4.0),
    "worn": LineState(0.81, 24.0),
    "night": LineState(0.81, 16.0),
}
"""States that `python -m benchmarks.planning --only states` measured in rendered frames, 22 players in each."""
LEAST_WIDTH_PX = WIDTH_CLASSES_PX[0][0]
"""Width in the picture below which no line is measured."""


def expect_measurements(lines: LinePoints, camera: Camera, state: LineState, hidden: float = 0.0) -> Measurements:
    """Return what the line reader is expected to measure of a camera's frame, each line where the camera puts it.

    `hidden`: share 0..1 of all lines that something covers, beyond the players of `state`. Trust is the part of a
    measurement that a point is worth: a point that is measured in half of all frames has half of it.
    """
    seen = VisibleLines.from_camera(lines, camera)
    # The whole of the matched filter has to lie in the picture.
    aside = filter_reach(seen.width_px)[:, None] * seen.normal
    wide_enough = seen.width_px >= LEAST_WIDTH_PX
    seen = seen[wide_enough & camera.sees(seen.pixel + aside) & camera.sees(seen.pixel - aside)]
    return Measurements(
        seen.index,
        seen.points,
        seen.pixel,
        seen.normal,
        seen.px_per_metre,
        seen.px_per_metre_up,
        seen.length_px,
        np.full(len(seen), (1 - hidden) * state.measured / state.alike),
    )
