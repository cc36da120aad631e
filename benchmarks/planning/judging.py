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
from worker.calibration.geometry.far_marking import on_the_ground
from worker.calibration.geometry.field import Field
from worker.calibration.planning.line_state import STATES, LineState, StateName
from worker.calibration.planning.plan import Plan, plan

QUANTITIES = {
    "rotation": "rotation of the pose",
    "position": "position of the pose",
    "refined rotation": "rotation of the refined pose",
    "refined position": "position of the refined pose",
    "calibration": "place on the ground, by the calibration",
    "place": "place on the ground, with the unevenness of the ground",
    "stitch": "distance between the places of two cameras",
}


@dataclass(frozen=True)
class Ratio:
    """Actual error over predicted sigma of one quantity of one camera, or pair of cameras; root of the mean square."""

    quantity: str
    value: float
    predicted: float


def chosen_states(venues: Sequence[BuiltVenue]) -> Iterator[str]:
    """Yield the noise model that the choosing half of the venues measures, a row for each state."""
    yield table_head("state | cameras | points of lines measured, by width in px | measured | width_px | misfit_px")
    for state in STATES:
        each = [one for venue in venues if venue.chooses and venue.state == state for one in calibrated(venue)]
        each = [one for one in each if one.accepted]
        if not each:
            continue
        expected, measured = (np.sum([getattr(one, name) for one in each], axis=0) for name in ("expected", "measured"))
        shares = measured / np.maximum(expected, 1)
        classes = zip(pairwise(WIDTHS_PX), shares, strict=True)
        widths = [f"{low:g} to {high:g}: {share:.0%}" for (low, high), share in classes]
        fit = _fitted(expected, shares, float(np.median([one.misfit_px for one in each])))
        yield (
            f"| {state} | {len(each)} | {', '.join(widths)} | {fit.measured:.2f} | {fit.width_px:.2f} "
            f"| {fit.misfit_px:.2f} |"
        )


def _fitted(expected: Array, shares: Array, misfit_px: float) -> LineState:
    """Return the state of the least squares of shares (W,) by width, each of so many `expected` points."""
    width = np.sqrt(np.array(WIDTHS_PX[:-1]) * WIDTHS_PX[1:])
    tried = [LineState(most, half, misfit_px) for most in np.arange(0.3, 1.0, 0.01) for half in np.arange(0.1, 2, 0.02)]
    return min(tried, key=lambda one: float(np.sum(expected * (one.share(width) - shares) ** 2)))


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


def _rms_of(found: Sequence[Ratio], quantity: str) -> str:
    values = [ratio.value for ratio in found if ratio.quantity == quantity]
    return f"{rms(values):.2f} ({len(values)})"


def _ratios(venue: BuiltVenue, states: dict[StateName, LineState]) -> Iterator[Ratio]:
    planned = plan(venue.pitch, venue.cameras, states[venue.state])
    found = calibrated(venue)
    for number, one in enumerate(found):
        if one.accepted:
            yield from _of_camera(venue, planned, number, one)
    for pair in planned.pairs:
        ids = [camera.id for camera in venue.cameras]
        numbers = [ids.index(name) for name in (pair.first, pair.second)]
        if all(found[number].accepted for number in numbers):
            truth = venue.ground(planned.xy)
            places = [_placed(venue, number, found[number].answered, truth) for number in numbers]
            off = np.linalg.norm(places[0] - places[1], axis=-1)[pair.seen]
            yield Ratio("stitch", rms(off[np.isfinite(off)]) / pair.stitch_m, pair.stitch_m)


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
