"""Venues that are planned and then calibrated: rendered with all that a plan takes into account.

Lens, field, ground and paint are as far from their model as the engine expects them to be; a part of the lines is worn,
far, in the dark or behind players.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from benchmarks.scenes import rendered
from demo.render import outdated
from fields.template import TURF_M, load
from models.training.drawing.noise import Patch
from models.training.pitches.conditions import Conditions
from models.training.pitches.world import build_world
from worker.calibration.geometry.camera import Array, Camera, Frame, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS, SIGMA_NAMES, Intrinsics
from worker.calibration.geometry.parameters import (
    LensParameter,
    Parameter,
    field_measures,
    lens_parameters,
    lens_parameters_without_heat,
    lens_values,
    with_lens_changed,
)
from worker.calibration.planning.line_state import STATES, StateName

VENUES, MOST_CAMERAS = 30, 3
SIZE = (1600, 900)
SPORTS = ("football", "football", "rugby-union", "hockey", "football", "american-football")
# Part of the renderer's swell, 23 mm in its octaves, of a ground that is uneven by 12 mm: turf without its roughness.
SWELL = TURF_M / 0.0233
# Errors of the stored poses from which calibrations begin.
START_M, START_DEG = 0.1, 1.0
SQUARE_M = 1e-3
"""Sigma of the right angles, which the renderer cannot have otherwise."""


@dataclass(frozen=True)
class BuiltVenue:
    """A venue as it is planned, `pitch` and `cameras`, and as it is built: `real_pitch`, `real` cameras and lenses.

    `state` of its lines; `conditions` of the rendering.
    """

    number: int
    state: StateName
    pitch: Field
    cameras: Sequence[Camera]
    real_pitch: Field
    real: Sequence[Camera]
    conditions: Conditions

    @property
    def chooses(self) -> bool:
        """True for the half of the venues of each sport and state that chooses the noise model; the others judge it."""
        return (self.number // len(SPORTS) + self.number) % 2 == 0

    def parameter_errors(self, parameters: Sequence[Parameter]) -> Array:
        """Return the true errors (E,) of parameters of lenses and field: what is real minus what is believed."""
        lenses = [
            lens_values(real.intrinsics) - lens_values(camera.intrinsics)
            for real, camera in zip(self.real, self.cameras, strict=True)
        ]
        field = {one.name: one.read(self.real_pitch) - one.read(self.pitch) for one in field_measures(self.pitch)}
        return np.array(
            [
                # Heat, which has numbers beyond those of the cameras, is part of the lens.
                (lenses[one.camera][LENS_PARAMETERS.index(one.name)] if one.camera < len(lenses) else 0.0)
                if isinstance(one, LensParameter)
                else field.get(one.name, 0.0)
                for one in parameters
            ]
        )

    def frames(self) -> dict[str, list[Frame]]:
        """Return a frame of each camera, rendered once."""
        return {
            camera.id: [rendered(f"planning-{self.number}-{camera.id}", self.real_pitch, camera, self.conditions)]
            for camera in self.real
        }

    def stored(self) -> list[Camera]:
        """Return the cameras at the poses from which a calibration begins."""
        rng = np.random.default_rng([43, self.number])
        return [one.with_pose(outdated(one.pose, START_M, START_DEG, rng)) for one in self.cameras]

    def there(self, xy: Array) -> Array:
        """Return the places (..., 2) on the real field that correspond to those of the planned one, m."""
        return xy * np.array([self.real_pitch.length, self.real_pitch.width]) / [self.pitch.length, self.pitch.width]

    def ground(self, xy: Array) -> Array:
        """Return the true places (H, W, 3) of points (H, W, 2) of the planned field, neighbours on a grid."""
        there = self.there(xy)
        x, y = np.moveaxis(there.astype(np.float32), -1, 0)
        swell = build_world(self.real_pitch, self.conditions).bumps.at(Patch(x, y, x, np.ones(x.shape, dtype=bool)))
        return self.real_pitch.lift(there) + swell[..., None] * [0.0, 0.0, 1.0]


def built_venue(number: int) -> BuiltVenue:
    """Return a venue: a sport, one to three cameras beside the field, and a state of its lines.

    It is drawn as it is built. The plan believes in a lens and a field that are off by what is expected of them.
    """
    rng = np.random.default_rng([41, number])
    drawn = _field(SPORTS[number % len(SPORTS)])
    drawn_cameras = _cameras(drawn, rng)
    # No two lenses and no two fields are alike.
    real = [_changed(camera, rng.normal(size=len(LENS_PARAMETERS))) for camera in drawn_cameras]
    real_pitch = _resized(drawn, rng.normal(size=len(field_measures(drawn))))
    lens_errors, field_errors = _errors(number)
    state = list(STATES)[number % len(STATES)]
    cameras = [_stated(_changed(camera, -by)) for camera, by in zip(real, lens_errors[: len(real)], strict=True)]
    pitch = _resized(real_pitch, -field_errors)
    return BuiltVenue(number, state, pitch, cameras, real_pitch, real, conditions_of(state, rng))


def _errors(number: int) -> tuple[Array, Array]:
    """Return the errors of three lenses (3, 6) and of the measures of the field (3,), in sigmas.

    Those of fifteen venues are quantiles of the normal distribution, in random order (a Latin hypercube): of as many
    independent ones, the ridges may all in all be a third farther off than said.
    """
    half, index = (number // len(STATES)) % 2, number // (2 * len(STATES)) * len(STATES) + number % len(STATES)
    rng = np.random.default_rng([47, half])
    lenses = _quantiles(VENUES // 2 * MOST_CAMERAS, len(LENS_PARAMETERS), rng)
    fields = _quantiles(VENUES // 2, 3, rng)
    return lenses[MOST_CAMERAS * index : MOST_CAMERAS * (index + 1)], fields[index]


def _quantiles(rows: int, columns: int, rng: np.random.Generator) -> Array:
    normal = [NormalDist().inv_cdf((at + 0.5) / rows) for at in range(rows)]
    values = np.array(normal) / np.sqrt(np.mean(np.square(normal)))
    return np.stack([rng.permutation(values) for _ in range(columns)], axis=1)


def _changed(camera: Camera, by: Array) -> Camera:
    """Return the camera with a lens that is off by (6,) sigmas of a lens after photos of a board, and heat."""
    return with_lens_changed(camera, np.array([p.expected for p in lens_parameters([camera])]) * by)


def _resized(pitch: Field, by: Array) -> Field:
    """Return the field with measures that are off by (3,) sigmas of a careful measurement."""
    for measure, off in zip(field_measures(pitch), by.tolist(), strict=True):
        _, pitch = measure.applied([], pitch, measure.expected * off)
    return pitch


def _stated(camera: Camera) -> Camera:
    """Return the camera with the sigma of its lens, as `esc intrinsics` writes it: one that nobody states may be many
    times as large."""
    sigma = {SIGMA_NAMES[p.name]: p.expected for p in lens_parameters_without_heat([camera])}
    return camera.with_lens(replace(camera.intrinsics, sigma=sigma))


def conditions_of(state: StateName, rng: np.random.Generator) -> Conditions:
    """Return the conditions of a rendering that a state of the lines stands for: players are there in all of them."""
    drawn = replace(
        Conditions.random(rng),
        variety=0.3,
        long_shadows=0.0,
        rain=0.0,
        fog=0.0,
        snow=0.0,
        other_lines=False,
        players=22,
        blur=0.2,
        sharpening=0.4,
        jpeg_quality=92,
        swell=SWELL,
        wobble=1.0,
        fringe=0.3,
    )
    match state:
        case "fresh":
            return replace(drawn, light=str(rng.choice(["sun", "cloud"])), wear=0.1, noise=0.15)
        case "worn":
            return replace(drawn, light=str(rng.choice(["sun", "cloud"])), wear=0.75, noise=0.15)
        case "night":
            return replace(drawn, light="floodlight", wear=0.25, noise=0.6)


def _field(sport: str) -> Field:
    template = load(sport)
    length, width, line = (template.size[measure].default for measure in ("length", "width", "line"))
    half = max((length - width) / 2, 1.0)
    ridge = np.array([[-half, 0.0, 0.25], [half, 0.0, 0.25]])
    return Field(length, width, line, ridge, template, sigma={"skew_m": SQUARE_M})


def _cameras(pitch: Field, rng: np.random.Generator) -> list[Camera]:
    count = int(rng.choice([1, 2, 3], p=[0.5, 0.35, 0.15]))
    height, away = rng.uniform(6, 18), rng.uniform(5, 22)
    wide = rng.uniform(55, 80)
    apart = rng.choice([1.0, 1.0, 12.0])
    places = (np.arange(count) - (count - 1) / 2) * apart
    span = {1: 0.0, 2: 0.25, 3: 0.33}[count] * pitch.length
    targets = np.linspace(-span, span, count) + rng.normal(0, 3.0, count)
    return [
        _camera(
            f"camera-{at}",
            np.array([x, -pitch.width / 2 - away, height]),
            np.array([target, -pitch.width * rng.uniform(0.02, 0.15), 0.0]),
            wide + rng.normal(0, 2.0),
            rng,
        )
        for at, (x, target) in enumerate(zip(places, targets, strict=True))
    ]


def _camera(name: str, position: Array, target: Array, wide_deg: float, rng: np.random.Generator) -> Camera:
    focal = SIZE[0] / 2 / np.tan(np.radians(wide_deg / 2))
    centre = (np.array(SIZE) - 1) / 2 + rng.normal(0, 8, 2)
    k1 = rng.uniform(-0.25, -0.15)
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    lens = Intrinsics(matrix, np.array([k1, 0.5 * k1 * k1, 0, 0, 0]), SIZE)
    return Camera(name, lens, Pose.looking_at(position, target, roll_deg=float(rng.normal(0, 1))))
