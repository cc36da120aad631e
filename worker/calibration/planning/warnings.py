"""Warnings of a plan: what will not work, and what would help."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.diagnostics.registration import pairs_in_common
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.planning.line_state import LEAST_WIDTH_PX
from worker.calibration.planning.plan import CameraPlan, Plan
from worker.calibration.refinement.least_squares import FEWEST_MEASUREMENTS

WarningKind = Literal[
    "off-field",
    "few-lines",
    "undetermined",
    "one-direction",
    "thin-lines",
    "coarse-ground",
    "uneven-ground",
    "lens",
    "nothing-in-common",
    "not-covered",
]
REFUSED: tuple[WarningKind, ...] = ("off-field", "few-lines", "undetermined")
"""Warnings of cameras whose calibration the gate would refuse."""


@dataclass(frozen=True)
class PlanWarning:
    """Warning about `cameras`, by their ids (all, where it is about the field), in words with numbers and advice."""

    kind: WarningKind
    cameras: Sequence[str]
    words: str


def find_warnings(planned: Plan) -> list[PlanWarning]:
    """Return all warnings of a plan, those of each camera first."""
    found = [warning for one in planned.cameras for warning in _of_camera(planned, one)]
    return [*found, *_nothing_in_common(planned), *_not_covered(planned)]


def _of_camera(planned: Plan, one: CameraPlan) -> Iterator[PlanWarning]:
    ids = [one.camera.id]
    if one.markings is None:
        yield PlanWarning("off-field", ids, "no marking of the field is in view: turn the camera, or give a wider lens")
        return
    points = len(one.measured) * planned.state.measured * (1 - planned.hidden)
    if points < FEWEST_MEASUREMENTS:
        yield PlanWarning(
            "few-lines",
            ids,
            f"{points:.0f} points of lines can be measured, at least {FEWEST_MEASUREMENTS} are needed: let more "
            "markings into view, or more pixels onto them",
        )
        return
    metres, pixels, beyond = one.markings.worst(GATE.largest_ground_sigma_m, GATE.largest_ground_sigma_px)
    if beyond:
        yield PlanWarning(
            "undetermined",
            ids,
            f"the lines in view do not determine the pose: markings may lie {metres:.2f} m ({pixels:.1f} px) from "
            f"where it puts them (sigma, at most {GATE.largest_ground_sigma_m} m or {GATE.largest_ground_sigma_px} px "
            "pass the gate): let the camera see lines in more than one direction, or calibrate its lens more exactly",
        )
    if (across := _share_across(one)) < 0.05:
        yield PlanWarning(
            "one-direction",
            ids,
            f"nearly all measured lines run the same way, only {across:.0%} across it: the camera may slide along "
            "them; let a line across into view",
        )
    if one.seen.any():
        yield from _resolution(planned, one)
        yield from _dominant_errors(planned, one)


def _share_across(one: CameraPlan) -> float:
    """Return the share 0..1 of the measured line that runs across the direction in which most of it runs."""
    along = one.measured.points.tangent[:, :2]
    least, most = np.linalg.eigvalsh(along.T @ along)
    return float(least / (least + most))


def _resolution(planned: Plan, one: CameraPlan) -> Iterator[PlanWarning]:
    seen = VisibleLines.from_camera(planned.pitch.line_points(), one.camera)
    thin = float(np.mean(seen.width_px < LEAST_WIDTH_PX))
    if _is_much(thin):
        yield PlanWarning(
            "thin-lines",
            [one.camera.id],
            f"{thin:.0%} of the lines in view are thinner than {LEAST_WIDTH_PX:g} px and not measured: more height, a "
            "longer lens or more pixels would show them",
        )
    coarse = float(
        np.mean(one.px_per_metre_along[one.seen] < GATE.largest_ground_sigma_px / GATE.largest_ground_sigma_m)
    )
    if _is_much(coarse):
        yield PlanWarning(
            "coarse-ground",
            [one.camera.id],
            f"on {coarse:.0%} of the field in view a pixel covers more than {GATE.largest_ground_sigma_m} m along the "
            "line of sight, which is what a tracker's error of a pixel does to a player's place: stand higher, or take "
            "more pixels",
        )


def _is_much(share: float) -> bool:
    """True for a share of what a camera sees that is worth a warning."""
    return share > 0.3


def _dominant_errors(planned: Plan, one: CameraPlan) -> Iterator[PlanWarning]:
    calibrated, measured, place = (
        float(np.sqrt(np.mean(values[one.seen] ** 2))) for values in (one.calibrated_m, one.measured_m, one.place_m)
    )
    if 1 - (measured / calibrated) ** 2 > 0.75:
        yield PlanWarning(
            "lens",
            [one.camera.id],
            f"the uncertainty of lens and field decides: {100 * calibrated:.1f} cm on the ground, of which the lines "
            f"alone would leave {100 * measured:.1f} cm: calibrate the lens with more photos of a board, measure the "
            "field, or use the refined pose and lens",
        )
    if place > GATE.largest_ground_sigma_m and 1 - (calibrated / place) ** 2 > 0.5:
        yield PlanWarning(
            "uneven-ground",
            [one.camera.id],
            f"the ground, uneven by {1000 * planned.pitch.template.uneven:.0f} mm, moves what is seen at so flat an "
            f"angle by {100 * place:.0f} cm: stand higher or nearer",
        )


def _nothing_in_common(planned: Plan) -> Iterator[PlanWarning]:
    """Yield a warning for each camera that the gate could compare with no other one."""
    if len(planned.cameras) < 2:
        return
    pairs = pairs_in_common(planned.pitch, [one.camera for one in planned.cameras])
    compared = {camera.id for pair in pairs for camera in pair}
    for one in planned.cameras:
        if one.camera.id not in compared and one.markings is not None:
            yield PlanWarning(
                "nothing-in-common",
                [one.camera.id],
                "the camera shares too few markings with any other one for their views to be compared: turn them "
                "towards each other until both see a crossing of lines, or an arc",
            )


def _not_covered(planned: Plan) -> Iterator[PlanWarning]:
    bare = float(np.mean(planned.coverage == 0))
    if bare > 0.0:
        yield PlanWarning("not-covered", [], f"no camera sees {bare:.1%} of the field")
