"""Courts as fast as they are eaten: processes that make batches, none of which is shown twice."""

from __future__ import annotations

import multiprocessing
import os
from dataclasses import dataclass
from multiprocessing.queues import Queue

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.courts.court import random_court
from models.training.data.cache import Crops

AHEAD = 8
"""Batches that wait for the network at most."""


@dataclass(frozen=True)
class Batch:
    """Pictures (N, 3, S, S) RGB in 0..1, targets (N, 1, S, S), and `asked` (N, 1, S, S): 0 where no answer counts."""

    pictures: NDArray[np.float32]
    targets: NDArray[np.float32]
    asked: NDArray[np.float32]

    def joined(self, other: Batch) -> Batch:
        """Both, one after the other."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Batch(*(np.concatenate(pair) for pair in pairs))


def courts(rng: np.random.Generator, count: int, size: int) -> Batch:
    """A batch of courts."""
    made = [random_court(rng, size) for _ in range(count)]
    return Batch(
        np.stack([court.frame[..., ::-1].transpose(2, 0, 1) for court in made]).astype(np.float32) / 255,
        np.stack([court.target[None] for court in made]),
        np.stack([court.asked[None] for court in made]),
    )


class Stream:
    """Batches of `courts` fresh courts and `pitches` rendered ones of `size` px; its processes end with their parent.

    `seed` has to be another one after each restart, or the same courts come again.
    """

    def __init__(self, crops: Crops, courts: int, pitches: int, size: int, seed: int, workers: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.crops, self.courts, self.pitches, self.size = crops, courts, pitches, size
        self.queue: Queue[Batch] = context.Queue(AHEAD)
        for worker in range(workers if courts else 0):
            job = (self.queue, [seed, worker], courts, size)
            context.Process(target=_make, args=job, daemon=True).start()

    def next(self) -> Batch:
        """The next batch."""
        batches = []
        if self.courts:
            batches.append(self.queue.get())
        if self.pitches:
            pictures, targets = self.crops.batch(self.pitches, self.size)
            batches.append(Batch(pictures, targets, np.ones_like(targets)))
        return batches[0] if len(batches) == 1 else batches[0].joined(batches[1])


def _make(queue: Queue[Batch], seed: list[int], count: int, size: int) -> None:
    os.nice(4)
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    while True:
        queue.put(courts(rng, count, size))
