"""Crops as fast as they are eaten: processes that make courts and pitches, none of which is made twice."""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing.queues import Queue
from queue import Empty

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.courts.court import random_court
from models.training.pitches.crops import random_crop

PACK = 8
"""Crops that a process hands over at once."""
AHEAD = 8
"""Packs that wait at most, of each process."""
LOOK_S = 5.0
"""Between two looks at whether anybody still makes crops, while there are none."""

Planes = NDArray[np.uint8]
"""Crops (N, 5, S, S): red, green, blue, share of the pixel that paint covers, and whether the pixel's answer counts."""


def random_planes(rng: np.random.Generator, size: int, pitches: float) -> Planes:
    """One crop (5, S, S) of `size` px: a pitch in so many of 1, else a court."""
    if rng.random() < pitches:
        rendering = random_crop(rng, size)
        frame, target, asked = rendering.frame, rendering.target, np.ones((size, size), np.float32)
    else:
        court = random_court(rng, size)
        frame, target, asked = court.frame, court.target, court.asked
    shares = np.stack([target, asked])
    return np.concatenate([frame[..., ::-1].transpose(2, 0, 1), np.round(255 * shares).astype(np.uint8)])


class Makers:
    """`workers` processes that make crops of `size` px, a share of them `pitches`, and end with their parent.

    `seed` has to be another one after each restart, or the same crops come again.
    """

    def __init__(self, size: int, pitches: float, seed: int, workers: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.size = size
        self._queue: Queue[Planes] = context.Queue(AHEAD * workers)
        jobs = ((self._queue, [seed, worker], size, pitches) for worker in range(workers))
        self._processes = [context.Process(target=_make, args=job, daemon=True) for job in jobs]
        for process in self._processes:
            process.start()

    def wait(self) -> Planes:
        """The next crops, as soon as there are some; raises RuntimeError if there will be none."""
        while True:
            try:
                return self._queue.get(timeout=LOOK_S)
            except Empty:
                if not any(process.is_alive() for process in self._processes):
                    raise RuntimeError("no process makes crops any more: see above what ended them") from None

    def made(self) -> list[Planes]:
        """Return all crops that are waiting."""
        packs = []
        while True:
            try:
                packs.append(self._queue.get_nowait())
            except Empty:
                return packs


def _make(queue: Queue[Planes], seed: list[int], size: int, pitches: float) -> None:
    os.nice(4)
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    while True:
        queue.put(np.stack([random_planes(rng, size, pitches) for _ in range(PACK)]))
