"""Months of nights in which cameras move as a test says, written as a worker's results would be."""

import random
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta

import sqlalchemy as sa

from service.schemas.results import Sigma
from service.schemas.trend import Displacement
from service.store import tables
from testbed.stock import Stock, result

SIGMA_M, SIGMA_FOCAL = 0.01, 0.0004
# Metres at the far touchline for a focal length that is longer by all of it.
FOCAL_LENGTH_M = 60.0


def displacement(across_m: float, away_m: float = 0.0, focal_length: float | None = 0.0, anchor: int | None = None):
    """Return the displacement of a camera as a worker reports it."""
    return Displacement(
        anchor=anchor,
        at=[-20.0, 34.0],
        across_m=across_m,
        away_m=away_m,
        sigma_across_m=1.5 * SIGMA_M,
        sigma_away_m=3 * SIGMA_M,
        repeatability_across_m=SIGMA_M,
        repeatability_away_m=2 * SIGMA_M,
        rotation_deg=abs(across_m),
        position_m=0.001,
        focal_length=focal_length,
        sigma_focal_length=None if focal_length is None else SIGMA_FOCAL,
        focal_length_m=FOCAL_LENGTH_M,
    )


def night(stock: Stock, moved: Displacement | None, *, accepted: bool = True, at: datetime | None = None) -> str:
    """A calibration that finds every camera so far from its anchor; `at`: when it ended."""
    job_id = stock.submitted("v")
    task = stock.attempts.begin(job_id)
    found = result(task.venue, accepted)
    cameras = []
    for camera in found.cameras:
        anchor = task.anchors.get(camera.id)
        told = moved and moved.model_copy(update={"anchor": anchor.revision if anchor else None})
        sigma = Sigma(rotation_deg=0.002, position_m=0.004)
        cameras.append(camera.model_copy(update={"displacement": told, "sigma": sigma}))
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
    if at is not None:
        _put_back_to(stock, job_id, at)
    return job_id


def nights(
    stock: Stock,
    count: int,
    first: datetime,
    moved: Callable[[int], Displacement],
    numbers: Iterable[int] | None = None,
) -> None:
    """A calibration every night from the first one on, or on those of these `numbers`."""
    for number in range(count) if numbers is None else numbers:
        night(stock, moved(number), at=first + timedelta(days=number))


def noisy(seed: int, mean_m: Callable[[int], float] = lambda _: 0.0, focal: Callable[[int], float] = lambda _: 0.0):
    """Nights around means, of the spread that is stated."""
    rng = random.Random(seed)

    def moved(number: int) -> Displacement:
        return displacement(
            mean_m(number) + rng.gauss(0, SIGMA_M),
            rng.gauss(0, 2 * SIGMA_M),
            focal(number) + rng.gauss(0, SIGMA_FOCAL),
        )

    return moved


def _put_back_to(stock: Stock, job_id: str, at: datetime) -> None:
    """The night of a job was then, and the charts are drawn by that once the next one comes."""
    t, c = tables.camera_trend.c, tables.camera_anchors.c
    with stock.engine.begin() as connection:
        connection.execute(sa.update(tables.camera_trend).where(t.job == job_id).values(at=at))
        connection.execute(sa.update(tables.camera_anchors).where(c.at > at).values(at=at))
