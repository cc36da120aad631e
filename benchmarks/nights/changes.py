"""Changes of a camera and its field over the nights: the real camera of each night, and the paint before it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from demo.render import outdated
from testbed.simulated_nights import Painted
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.parameters import with_focal_length

HEAT, JOBS_A_DAY = 3e-4, 6
"""Half of what a day does to a focal length, part of it, and into how many jobs that day is divided."""
CALM_M, CALM_DEG = 0.002, 0.005
WIND_M, WIND_DEG = 0.02, 0.05
BEFORE = 8
"""Nights before something happens once."""
AIMED_ANEW_DEG, REPAINTED_M = 2.0, 0.10


@dataclass(frozen=True)
class Night:
    """One night: the `real` camera and the field before it. `begun`: whether a search found the camera anew."""

    real: Camera
    painted: Painted
    searched: bool = False


@dataclass(frozen=True)
class Change:
    """A kind of change: its `nights` for a camera before a field. `honest`: whether pose and lens may be accepted in
    every one of them, since nothing happens that the service was not told of."""

    nights: Callable[[Camera, Painted, np.random.Generator], Iterator[Night]]
    count: int
    honest: bool = False
    focal: Callable[[int], float] = lambda _: 0.0


def _zoomed(longer: Callable[[int], float], count: int, *, honest: bool = False) -> Change:
    """A focal length that is `longer` by a part of it each night."""

    def nights(camera: Camera, painted: Painted, rng: np.random.Generator) -> Iterator[Night]:
        for night in range(count):
            focal_px = camera.intrinsics.focal_length_px
            yield Night(_swayed(with_focal_length(camera, longer(night) * focal_px), CALM_M, CALM_DEG, rng), painted)

    return Change(nights, count, honest, longer)


def _stepped(by: float) -> Change:
    return _zoomed(lambda night: by * (night >= BEFORE), 2 * BEFORE)


def _creeping(by: float, count: int) -> Change:
    return _zoomed(lambda night: by * night, count)


def _in_wind(camera: Camera, painted: Painted, rng: np.random.Generator) -> Iterator[Night]:
    for _ in range(20):
        yield Night(_swayed(camera, WIND_M, WIND_DEG, rng), painted)


def _repainted(camera: Camera, painted: Painted, rng: np.random.Generator) -> Iterator[Night]:
    """The longest marking in view lies elsewhere after the eighth night."""
    anew = painted.painted_anew(painted.longest_seen(camera), REPAINTED_M)
    for night in range(2 * BEFORE):
        yield Night(_swayed(camera, CALM_M, CALM_DEG, rng), painted if night < BEFORE else anew)


def _aimed_anew(camera: Camera, painted: Painted, rng: np.random.Generator) -> Iterator[Night]:
    axis = rng.normal(size=3)
    turn = np.radians(AIMED_ANEW_DEG) * axis / np.linalg.norm(axis)
    elsewhere = moved(camera, np.concatenate([turn, np.zeros(3)]))
    for night in range(2 * BEFORE):
        real = camera if night < BEFORE else elsewhere
        yield Night(_swayed(real, CALM_M, CALM_DEG, rng), painted, searched=night == BEFORE)


def _swayed(camera: Camera, shift_m: float, turn_deg: float, rng: np.random.Generator) -> Camera:
    return replace(camera, pose=outdated(camera.pose, shift_m, turn_deg, rng))


CHANGES: Mapping[str, Change] = {
    "none": _zoomed(lambda _: 0.0, 24, honest=True),
    "heat of a day, ± 0.03 %": _zoomed(lambda n: HEAT * np.sin(2 * np.pi * n / JOBS_A_DAY), 24, honest=True),
    "wind, 2 cm and 0.05°": Change(_in_wind, 20, honest=True),
    "a line painted anew, 10 cm aside": Change(_repainted, 2 * BEFORE),
    "aimed anew, by 2°": Change(_aimed_anew, 2 * BEFORE),
    "focal length steps by 0.1 %": _stepped(0.001),
    "by 0.2 %": _stepped(0.002),
    "by 0.3 %": _stepped(0.003),
    "by 1 %": _stepped(0.01),
    "creeps by 0.05 % a job": _creeping(0.0005, 40),
    "by 0.02 %": _creeping(0.0002, 100),
    "by 0.01 %": _creeping(0.0001, 200),
}
LONG: Mapping[str, Change] = {
    "none, 1000 jobs": _zoomed(lambda _: 0.0, 1000, honest=True),
    "creeps by 0.01 % a job, 1000 jobs": _creeping(0.0001, 1000),
}
