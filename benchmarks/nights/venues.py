"""Venues that do not match their models, over a hundred nights: answers, refined ones, and where pictures meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.printing import rms, table_head
from benchmarks.scenes import LAYOUTS, Scene, as_built, placed_cameras
from benchmarks.truth import apart, errors
from demo.render import outdated
from testbed.simulated_nights import SHARED_PX, Installation, Painted, SimulatedSight
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field

NIGHTS = (1, 10, 30, 100)
VENUES = ("pair", "low pair", "apart", "three", "four")
CROWNS_M = (0.15, 0.40)
STORED_M, STORED_DEG = 0.02, 0.05
WIND_M, WIND_DEG = 0.01, 0.03


@dataclass(frozen=True)
class Night:
    """Figures of all cameras of a venue: errors of the answer and of the refined poses, m, the latter over sigma,
    the stitch error of the answer (1 px = 10 cm), and how many were accepted."""

    error_m: list[float]
    refined_m: list[float]
    over_sigma: list[float]
    answer_over_sigma: list[float]
    stitch_px: float
    accepted: int


def table(executor: Executor, number: int) -> Iterator[str]:
    """A row for each layout after some of the nights; `number` venues of each layout."""
    yield table_head(
        "venue | night | accepted | error, cm, rms | over sigma, rms | refined, cm, rms | over sigma, rms "
        "| stitch, px, mean (most)"
    )
    layouts, numbers = zip(*((layout, n) for layout in VENUES for n in range(number)), strict=True)
    done = list(zip(layouts, executor.map(_nights, layouts, numbers), strict=True))
    for layout in VENUES:
        its = [nights for name, nights in done if name == layout]
        yield from (_row(layout, night, [nights[night - 1] for nights in its]) for night in NIGHTS)
    everything = [nights for _, nights in done]
    yield from (_row("all", night, [nights[night - 1] for nights in everything]) for night in NIGHTS)


def _row(name: str, number: int, nights: Sequence[Night]) -> str:
    cameras = sum(len(night.error_m) for night in nights)
    figures = (
        rms([100 * error for night in nights for error in night.error_m]),
        rms([ratio for night in nights for ratio in night.answer_over_sigma]),
        rms([100 * error for night in nights for error in night.refined_m]),
        rms([ratio for night in nights for ratio in night.over_sigma]),
    )
    stitch = [night.stitch_px for night in nights]
    return (
        f"| {name} | {number} | {sum(night.accepted for night in nights)} of {cameras} "
        f"| {' | '.join(f'{figure:.2f}' for figure in figures)} | {np.mean(stitch):.3f} ({max(stitch):.2f}) |"
    )


def _nights(layout: str, number: int) -> list[Night]:
    return list(nights(layout, number))


def nights(layout: str, number: int) -> Iterator[Night]:
    """The nights of one venue, whose lenses are as a good board leaves them."""
    rng = np.random.default_rng([19, VENUES.index(layout), number])
    crown = float(rng.uniform(*CROWNS_M))
    pitch = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, crown], [18.5, 0.0, crown]]), sigma=TAPED)
    believed = placed_cameras(LAYOUTS[layout], rng)
    built = [as_built(camera, rng) for camera in believed]
    painted = Painted.drawn(pitch, rng)
    shared = SHARED_PX * rng.normal(size=(len(built), len(painted.lines)))
    stored = [replace(one, pose=outdated(one.pose, STORED_M, STORED_DEG, rng)) for one in believed]
    venue = Installation(pitch, stored)
    for _ in range(max(NIGHTS)):
        real = [replace(one, pose=outdated(one.pose, WIND_M, WIND_DEG, rng)) for one in built]
        yield _night(venue, real, SimulatedSight.of_night(painted, real, shared, rng))


def _night(venue: Installation, real: Sequence[Camera], sight: SimulatedSight) -> Night:
    results = venue.night(sight)
    true = [a.with_pose(b.pose) for a, b in zip(venue.stored, real, strict=True)]
    scene = Scene("", False, venue.pitch, true, list(real), {})
    told = [(result, camera) for result, camera in zip(results, real, strict=True) if result.refined is not None]
    return Night(
        [apart(result.camera, camera)[0] for result, camera in told],
        [apart(result.refined.camera, camera)[0] for result, camera in told],
        [apart(result.refined.camera, camera)[0] / result.refined.sigma.position_m for result, camera in told],
        [apart(result.camera, camera)[0] / result.sigma.position_m for result, camera in told],
        errors(scene, [result.camera for result in results]).stitch_px or 0.0,
        sum(result.accepted for result in results),
    )
