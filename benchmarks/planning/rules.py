"""Rules of thumb: how exactly a player is placed, by height, distance, overlap and pixels, as `esc plan` says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.printing import table_head
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.planning.line_state import STATES, StateName
from worker.calibration.planning.plan import Plan, plan
from worker.calibration.planning.variations import panned

MEASURED = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]]), sigma=TAPED)


@dataclass(frozen=True)
class Stand:
    """Two cameras on one mast beside the halfway line, each over a half of a football pitch.

    `away_m` from the touchline; `wide_deg`: horizontal field of view; `closer_deg`: turned towards each other;
    `second_side`: -1 where the second camera stands on the other side of the pitch; `pitch`: the field, as well known
    as its `sigma` says.
    """

    height_m: float = 12.0
    away_m: float = 15.0
    wide_deg: float = 75.0
    width_px: int = 3840
    closer_deg: float = 0.0
    second_side: int = 1
    state: StateName = "fresh"
    hidden: float = 0.0
    pitch: Field = MEASURED

    def plan(self) -> Plan:
        """Return the plan of both cameras."""
        return plan(self.pitch, [self._camera(-1), self._camera(1)], STATES[self.state], self.hidden)

    def _camera(self, side: int) -> Camera:
        size = self.width_px, self.width_px * 9 // 16
        focal = size[0] / 2 / np.tan(np.radians(self.wide_deg / 2))
        matrix = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
        near = 1 if side < 0 else self.second_side
        position = [0.5 * side, -near * (self.pitch.width / 2 + self.away_m), self.height_m]
        pose = Pose.looking_at(position, [24.0 * side, -near * 10.0, 0.0])
        camera = Camera("left" if side < 0 else "right", Intrinsics(matrix, np.zeros(5), size), pose)
        return panned(camera, side * near * self.closer_deg / 2)


USUAL = Stand()
STANDS = {
    "12 m up, 15 m away, 75° wide, 4K": USUAL,
    "6 m up": replace(USUAL, height_m=6.0),
    "9 m up": replace(USUAL, height_m=9.0),
    "18 m up": replace(USUAL, height_m=18.0),
    "25 m up": replace(USUAL, height_m=25.0),
    "30 m away, 60° wide": replace(USUAL, away_m=30.0, wide_deg=60.0),
    "turned 10° towards each other": replace(USUAL, closer_deg=10.0),
    "the second one on the far side": replace(USUAL, second_side=-1, closer_deg=20.0),
    "1920 pixels wide": replace(USUAL, width_px=1920),
    "worn lines": replace(USUAL, state="worn"),
    "half of the lines hidden": replace(USUAL, hidden=0.5),
    "a pitch that nobody measured": replace(USUAL, pitch=replace(MEASURED, sigma={})),
}
"""Stands of the table, each unlike the first in what its name says."""


def rules() -> Iterator[str]:
    """Yield a row for each way of standing."""
    yield table_head("stand | px/m, far | overlap, m² | place, cm | worst | calibration, cm | stitch, cm")
    for name, stand in STANDS.items():
        yield _row(name, stand.plan())


def _row(name: str, planned: Plan) -> str:
    one = planned.cameras[0]
    across, along = (float(np.nanmedian(values[0])) for values in (one.px_per_metre, one.px_per_metre_along))
    (place, worst), (calibration, _) = (
        100 * np.quantile(values[one.seen], [0.5, 0.95]) for values in (one.place_m, one.calibrated_m)
    )
    pair = planned.pairs[0] if planned.pairs else None
    overlap, stitch = (
        ("0", "-") if pair is None else (f"{pair.seen.sum() * planned.cell_m2:.0f}", f"{100 * pair.stitch_m:.1f}")
    )
    return (
        f"| {name} | {across:.0f}, {along:.1f} | {overlap} | {place:.1f} | {worst:.1f} | {calibration:.1f} | {stitch} |"
    )
