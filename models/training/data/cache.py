"""Rendered crops on disk: worker processes fill a folder with shards, the loader reads them again and again."""

from __future__ import annotations

import multiprocessing
import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.pitches.crops import CROP_SIZE, random_crop

SHARD_CROPS = 64


def render_shards(folder: Path, seed: int, worker: int, first: int, last: int) -> None:
    """Fill shards first..last-1 of `folder` that are not there yet; (64, S, S, 4) uint8: blue, green, red, target."""
    os.nice(4)
    cv2.setNumThreads(1)
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(first, last):
        path = folder / f"{worker:02d}-{number:05d}.npy"
        if path.exists():
            continue
        crops = np.empty((SHARD_CROPS, CROP_SIZE, CROP_SIZE, 4), np.uint8)
        for index in range(SHARD_CROPS):
            rendering = random_crop(np.random.default_rng([seed, worker, number, index]))
            crops[index, ..., :3] = rendering.frame
            crops[index, ..., 3] = np.round(rendering.target * 255)
        partial = path.with_suffix(".partial")
        with partial.open("wb") as file:
            np.save(file, crops)
        partial.rename(path)


def start_workers(folder: Path, seed: int, workers: int, shards: int) -> list[multiprocessing.Process]:
    """Processes that render `shards` shards each and end with their parent."""
    context = multiprocessing.get_context("spawn")
    started = []
    for worker in range(workers):
        process = context.Process(target=render_shards, args=(folder, seed, worker, 0, shards), daemon=True)
        process.start()
        started.append(process)
    return started


class Crops:
    """Batches drawn at random from all shards that are there by now."""

    def __init__(self, folder: Path, rng: np.random.Generator) -> None:
        self.folder, self.rng = folder, rng
        self.shards: list[NDArray[np.uint8]] = []
        self.known: set[Path] = set()

    def refresh(self) -> int:
        """Take in new shards; the number of crops at hand."""
        for path in sorted(self.folder.glob("*.npy")):
            if path not in self.known:
                self.known.add(path)
                self.shards.append(np.load(path, mmap_mode="r"))
        return SHARD_CROPS * len(self.shards)

    def batch(self, count: int, size: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Pictures (N, 3, size, size) RGB in 0..1 and targets (N, 1, size, size)."""
        pictures = np.empty((count, 3, size, size), np.float32)
        targets = np.empty((count, 1, size, size), np.float32)
        for index in range(count):
            crop = self._augmented(size)
            pictures[index] = crop[..., 2::-1].transpose(2, 0, 1) / 255
            targets[index, 0] = crop[..., 3] / 255
        return pictures, targets

    def _augmented(self, size: int) -> NDArray[np.float32]:
        """One crop: flipped, cut, now and then turned, sheared and scaled; brighter, darker, another cast."""
        rng = self.rng
        shard = self.shards[rng.integers(len(self.shards))]
        crop = np.asarray(shard[rng.integers(len(shard))])
        if rng.random() < 0.5:
            crop = crop[:, ::-1]
        if rng.random() < 0.08:
            crop = crop[::-1]
        if rng.random() < 0.12:
            crop = crop.transpose(1, 0, 2)
        spare = crop.shape[0] - size
        if rng.random() < 0.35:
            crop = _warped(np.ascontiguousarray(crop), size, rng)
        else:
            top, left = rng.integers(0, spare + 1, 2)
            crop = crop[top : top + size, left : left + size]
        crop = crop.astype(np.float32)
        if rng.random() < 0.35:
            _fringe(crop, rng)
        if rng.random() < 0.6:
            gain = np.exp(rng.normal(0, 0.15)) * np.exp(rng.normal(0, 0.06, 3))
            power = np.exp(rng.normal(0, 0.15))
            crop[..., :3] = 255 * np.clip(crop[..., :3] / 255, 0, 1) ** power * gain
        if rng.random() < 0.05:
            crop[..., :3] = crop[..., :3].mean(axis=-1, keepdims=True)
        if rng.random() < 0.2:
            crop[..., :3] += rng.normal(0, rng.uniform(0, 8), (size, size, 1))
        crop[..., :3] = np.clip(crop[..., :3], 0, 255)
        return crop


def _fringe(crop: NDArray[np.float32], rng: np.random.Generator) -> None:
    """Move blue one way and red the other, as cheap lenses do towards the edges of the frame."""
    move = rng.normal(0, 2.0, 2)
    for channel, share in ((0, 1.0), (2, float(rng.uniform(-0.6, 0.2)))):
        shift = np.array([[1, 0, share * move[0]], [0, 1, share * move[1]]])
        plane = np.ascontiguousarray(crop[..., channel])
        crop[..., channel] = cv2.warpAffine(plane, shift, plane.shape[::-1], borderMode=cv2.BORDER_REFLECT_101)


def _warped(crop: NDArray[np.uint8], size: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    angle, scale, shear = rng.normal(0, 0.15), np.exp(rng.normal(0, 0.15)), rng.normal(0, 0.1)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    linear = scale * turn @ np.array([[1, shear], [0, 1]])
    middle, target = np.full(2, crop.shape[0] / 2), np.full(2, size / 2) + rng.uniform(-10, 10, 2)
    move = np.column_stack([linear, target - linear @ middle])
    return cv2.warpAffine(crop, move, (size, size), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
