"""Single cameras, wide and tele, over sequences of nights: what is accepted, and when a change is named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.lenses import FARTHEST_M, FOCAL_LENGTHS, PITCH, SIGMAS, VIEWS, camera_of_view
from benchmarks.nights.changes import CHANGES, LONG, Change, Night
from benchmarks.printing import rms, table_head
from benchmarks.scenes import as_built
from benchmarks.truth import apart
from demo.render import outdated
from testbed.simulated_nights import SHARED_PX, Installation, Painted, SimulatedSight
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera

LEAST_WRONG_M = 0.005
COSTS_M = 0.10
FOUND_M, FOUND_DEG = 0.02, 0.03
"""How near a search leaves a camera."""
LONG_VIEWS = ("box",)


@dataclass(frozen=True)
class Job:
    """One job: the error of its answer and of the refined one, m, with their sigmas; `named`: whether it says that the
    focal length has changed; `because`: why it was refused, in a word."""

    error_m: float
    sigma_m: float
    refined_m: float
    refined_sigma_m: float
    named: bool
    because: str | None

    @property
    def accepted(self) -> bool:
        """True if the answer replaced the stored pose."""
        return self.because is None

    @property
    def wrong(self) -> bool:
        """True if it was accepted, and is farther off than three of its sigmas, or than 30 cm."""
        beyond = self.error_m > max(SIGMAS * self.sigma_m, LEAST_WRONG_M)
        return self.accepted and (beyond or self.error_m > FARTHEST_M)


def table(executor: Executor, number: int) -> Iterator[str]:
    """A row for each change: every view at every focal length, `number` cameras of each."""
    yield table_head(
        "what happens | jobs | accepted | accepted and wrong | error, cm, median (most) | error / sigma, most "
        "| refined: rms, cm | error / sigma, rms | change named | error before, cm, most"
    )
    for changes, views in ((CHANGES, tuple(VIEWS)), (LONG, LONG_VIEWS)):
        cases = [(focal, view, n) for focal in FOCAL_LENGTHS for view in views for n in range(number)]
        for name in changes:
            done = list(executor.map(_sequence, *zip(*((*case, name) for case in cases), strict=True)))
            yield _row(name, (changes[name]), done)


def _row(name: str, change: Change, sequences: Sequence[Sequence[Job]]) -> str:
    jobs = [job for sequence in sequences for job in sequence]
    taken = [job for job in jobs if job.accepted]
    errors = np.array([job.error_m for job in taken])
    refined = np.array([job.refined_m for job in taken])
    ratios = np.array([job.refined_m / job.refined_sigma_m for job in taken])
    named = [next((n for n, job in enumerate(sequence) if job.named), None) for sequence in sequences]
    before = [
        job.error_m
        for sequence, first in zip(sequences, named, strict=True)
        for job in sequence[: len(sequence) if first is None else first]
        if job.accepted
    ]
    told = "" if change.honest else f"{sum(n is not None for n in named)} of {len(named)}"
    return (
        f"| {name} | {len(jobs)} | {len(taken) / len(jobs):.1%} | {sum(job.wrong for job in jobs)} "
        f"| {100 * np.median(errors):.1f} ({100 * errors.max():.0f}) "
        f"| {max(job.error_m / job.sigma_m for job in taken):.1f} "
        f"| {100 * rms(refined):.1f} | {rms(ratios):.2f} "
        f"| {told} | {100 * max(before, default=0.0):.0f} |"
    )


def _sequence(focal: float, view: str, number: int, name: str) -> list[Job]:
    return list(sequence(focal, view, number, {**CHANGES, **LONG}[name]))


def sequence(focal: float, view: str, number: int, change: Change) -> Iterator[Job]:
    """The jobs of one camera whose lens is as a good board leaves it."""
    rng = np.random.default_rng([17, int(focal), list(VIEWS).index(view), number])
    believed = camera_of_view(focal, view, rng)
    real = as_built(believed, rng)
    painted = Painted.drawn(PITCH, rng)
    shared = SHARED_PX * rng.normal(size=(1, len(painted.lines)))
    stored = replace(believed, pose=outdated(real.pose, FOUND_M, FOUND_DEG, rng))
    venue = Installation(PITCH, [stored])
    for night in change.nights(real, painted, rng):
        sight = SimulatedSight.of_night(night.painted, [night.real], shared, rng)
        yield _job(venue.night(sight, _begun(venue, night, rng))[0], night.real)


def _begun(venue: Installation, night: Night, rng: np.random.Generator) -> Sequence[Camera] | None:
    if not night.searched:
        return None
    return [replace(venue.stored[0], pose=outdated(night.real.pose, FOUND_M, FOUND_DEG, rng))]


def _job(result: CameraResult, real: Camera) -> Job:
    sigma, refined = result.sigma, result.refined
    return Job(
        apart(result.camera, real)[0],
        np.inf if sigma is None else sigma.position_m,
        np.inf if refined is None else apart(refined.camera, real)[0],
        np.inf if refined is None else refined.sigma.position_m,
        result.lens_changed,
        None if result.refusal is None else result.refusal.reason,
    )
