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


ALIKE = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
"""Numbers of neighbouring line points whose errors may be the same."""


@dataclass(frozen=True)
class Ratio:
    """Actual error over predicted sigma of one quantity of one camera, or pair of cameras; root of the mean square."""

    quantity: str
    value: float
    predicted: float


def chosen_states(venues: Sequence[BuiltVenue]) -> Iterator[str]:
    """Yield the noise model that the choosing half of the venues speaks for, a row for each state."""
    half = [venue for venue in venues if venue.chooses]
    yield table_head("state | cameras | points of lines measured, by width in px | measured")
    shares = {}
    for state in STATES:
        each = [one for venue in half if venue.state == state for one in calibrated(venue) if one.accepted]
        if not each:
            continue
        expected, measured = (np.sum([getattr(one, name) for one in each], axis=0) for name in ("expected", "measured"))
        classes = zip(pairwise(WIDTHS_PX), measured, expected, strict=True)
        widths = [f"{low:g} to {high:g}: {found / of:.0%}" for (low, high), found, of in classes if of]
        shares[state] = float(measured.sum() / expected.sum())
        yield f"| {state} | {len(each)} | {', '.join(widths)} | {shares[state]:.2f} |"
    misfit = {
        alike: _misfit(half, {state: LineState(share, alike) for state, share in shares.items()}) for alike in ALIKE
    }
    yield f"\nPoints that err alike: {min(misfit, key=misfit.__getitem__):g}."


def _misfit(venues: Sequence[BuiltVenue], states: dict[StateName, LineState]) -> float:
    """Return how far the ratios of all quantities are from 1: the sum of the squares of their logarithms."""
    found = [ratio for venue in venues for ratio in _ratios(venue, states)]
    by_quantity = [rms([ratio.value for ratio in found if ratio.quantity == quantity]) for quantity in QUANTITIES]
    return float(np.sum(np.log(by_quantity) ** 2))


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
