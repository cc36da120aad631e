"""Predicted sigmas against actual errors, and the noise model that half of the venues choose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.planning.runs import WIDTHS_PX, Calibrated, calibrated
from benchmarks.planning.venues import BuiltVenue
from benchmarks.printing import rms, table_head
from benchmarks.truth import apart
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import change_between
from worker.calibration.geometry.far_marking import on_the_ground
from worker.calibration.geometry.field import Field
from worker.calibration.planning.line_state import STATES, LineState, StateName
from worker.calibration.planning.plan import Plan, Planner, plan
from worker.calibration.refinement.expected_errors import ExpectedErrors
from worker.calibration.refinement.uncertainty import Sigma

QUANTITIES = {
    "lines": "pose, without the known errors of lens and field",
    "rotation": "rotation of the pose",
    "position": "position of the pose",
    "refined rotation": "rotation of the refined pose",
    "refined position": "position of the refined pose",
    "calibration": "place on the ground, by the calibration",
    "place": "place on the ground, with the unevenness of the ground",
    "stitch": "distance between the places of two cameras",
}


ALIKE = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
"""Numbers of neighbouring line points whose errors may be the same."""


@dataclass(frozen=True)
class Ratio:
    """Actual error over predicted sigma of one quantity of one camera, or pair of cameras; root of the mean square."""

    quantity: str
    value: float
    predicted: float


def chosen_states(venues: Sequence[BuiltVenue]) -> Iterator[str]:
    """Yield the noise model that the choosing half of the venues speaks for, a row for each state."""
    yield table_head("state | cameras | points of lines measured, by width in px | measured | alike")
    for state in STATES:
        half = [venue for venue in venues if venue.chooses and venue.state == state]
        each = [one for venue in half for one in calibrated(venue) if one.accepted]
        if not each:
            continue
        expected, measured = (np.sum([getattr(one, name) for one in each], axis=0) for name in ("expected", "measured"))
        classes = zip(pairwise(WIDTHS_PX), measured, expected, strict=True)
        widths = [f"{low:g} to {high:g}: {found / of:.0%}" for (low, high), found, of in classes if of]
        share = float(measured.sum() / expected.sum())
        off = {
            alike: [
                r.value for v in half for r in _ratios(v, {state: LineState(share, alike)}) if r.quantity == "lines"
            ]
            for alike in ALIKE
        }
        nearest = min(off, key=lambda alike: abs(np.log(rms(off[alike]))))
        yield f"| {state} | {len(each)} | {', '.join(widths)} | {share:.2f} | {nearest:g} |"


def ratios(venues: Sequence[BuiltVenue], states: dict[StateName, LineState]) -> Iterator[str]:
    """Yield a row for each quantity: actual over predicted, of both halves and by state."""
    halves = {
        name: [v for v in venues if v.chooses == chooses] for name, chooses in (("chose", True), ("judge", False))
    }
    by_half = {name: [r for venue in half for r in _ratios(venue, states)] for name, half in halves.items()}
    by_state = {name: [r for v in halves["judge"] if v.state == name for r in _ratios(v, states)] for name in states}
    yield table_head(f"quantity | the half that chose | the half that judges | {' | '.join(states)} | sigma, median")
    for quantity, words in QUANTITIES.items():
        columns = [_rms_of(found, quantity) for found in (*by_half.values(), *by_state.values())]
        predicted = [r.predicted for r in by_half["judge"] if r.quantity == quantity]
        unit = "°" if "rotation" in quantity else " cm"
        median = np.median(predicted) * (1 if unit == "°" else 100)
        yield f"| {words} | {' | '.join(columns)} | {median:.3g}{unit} |"
    yield ""
    yield from _left_out(venues, states)


def _left_out(venues: Sequence[BuiltVenue], states: dict[StateName, LineState]) -> Iterator[str]:
    """Yield a line for each camera that no ratio counts."""
    for venue in venues:
        planned = plan(venue.pitch, venue.cameras, states[venue.state])
        for one, expected in zip(calibrated(venue), planned.cameras, strict=True):
            if not one.accepted or is_other_minimum(one, expected.sigma):
                why = f"sigma {100 * one.sigma[1]:.0f} cm" if one.accepted else "refused"
                yield f"Not counted: venue {venue.number}, {expected.camera.id}, {why}."


def _rms_of(found: Sequence[Ratio], quantity: str) -> str:
    values = [ratio.value for ratio in found if ratio.quantity == quantity]
    return f"{rms(values):.2f} ({len(values)})"


def _ratios(venue: BuiltVenue, states: dict[StateName, LineState]) -> Iterator[Ratio]:
    planner = Planner(venue.pitch, venue.cameras, states[venue.state], 0.0)
    planned = planner.plan()
    found = calibrated(venue)
    counted = [
        one.accepted and not is_other_minimum(one, expected.sigma)
        for one, expected in zip(found, planned.cameras, strict=True)
    ]
    for number, one in enumerate(found):
        if counted[number]:
            yield _by_lines(venue, planner.errors, number, one)
            yield from _of_camera(venue, planned, number, one)
    for pair in planned.pairs:
        ids = [camera.id for camera in venue.cameras]
        numbers = [ids.index(name) for name in (pair.first, pair.second)]
        if all(counted[number] for number in numbers):
            truth = venue.ground(planned.xy)
            places = [_placed(venue, number, found[number].answered, truth) for number in numbers]
            off = np.linalg.norm(places[0] - places[1], axis=-1)[pair.seen]
            yield Ratio("stitch", rms(off[np.isfinite(off)]) / pair.stitch_m, pair.stitch_m)


def _by_lines(venue: BuiltVenue, errors: ExpectedErrors, number: int, one: Calibrated) -> Ratio:
    """Return how far a pose is off, but for how it follows the true errors of lens and field, by all six numbers."""
    own = errors.unknowns.pose(number)
    follows = (errors.response @ venue.parameter_errors(errors.unknowns.parameters))[own]
    off = change_between(one.answered, venue.real[number]) - follows
    covariance = errors.by_measurement[own, own]
    value = np.sqrt(off @ np.linalg.solve(covariance, off) / len(off))
    return Ratio("lines", float(value), Sigma.from_covariance(covariance).position_m)


def is_other_minimum(one: Calibrated, expected: Sigma) -> bool:
    """True if a calibration says itself that it is far less exact than planned: it ended on other lines than those of
    its field, or beside its lens."""
    return one.sigma[1] > 5 * expected.position_m


def _of_camera(venue: BuiltVenue, planned: Plan, number: int, one: Calibrated) -> Iterator[Ratio]:
    expected = planned.cameras[number]
    for name, camera, sigma in (("", one.answered, expected.sigma), ("refined ", one.refined, expected.refined)):
        metres, degrees = apart(camera, venue.real[number])
        yield Ratio(f"{name}rotation", degrees / sigma.rotation_deg, sigma.rotation_deg)
        yield Ratio(f"{name}position", metres / sigma.position_m, sigma.position_m)
    even = venue.real_pitch.lift(venue.there(planned.xy))
    for name, truth, sigmas in (
        ("calibration", even, expected.calibrated_m),
        ("place", venue.ground(planned.xy), expected.place_m),
    ):
        off = np.linalg.norm(_placed(venue, number, one.answered, truth) - planned.xy, axis=-1)
        known = expected.seen & np.isfinite(off)
        yield Ratio(name, rms(off[known] / sigmas[known]), float(np.median(sigmas[known])))


def _placed(venue: BuiltVenue, number: int, camera: Camera, truth: Array) -> Array:
    """Return where a camera puts what the real one sees at true places (H, W, 3): (H, W, 2) of the planned field."""
    pixels = venue.real[number].project(truth).reshape(-1, 2)
    return on_the_field(venue.pitch, camera, pixels).reshape(*truth.shape[:2], 2)


def on_the_field(pitch: Field, camera: Camera, pixels: Array) -> Array:
    """Return the places (N, 2) of the field's surface that a camera sees in pixels (N, 2)."""
    height = np.zeros(len(pixels))
    # The roof is so flat that a few steps from the height last found reach it.
    for _ in range(4):
        places = on_the_ground(camera, pixels, height)
        height = pitch.height(places)
    return places
