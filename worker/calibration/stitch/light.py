"""How bright a camera takes the world, beside the others: exposure, white balance, and darker corners (vignetting)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, Frame, inside
from worker.calibration.scene.field import Field
from worker.calibration.scene.look import sampled
from worker.calibration.stitch.views import ViewChoice, chosen_view

# Cameras are compared in a view of this width, smoothed: neither noise nor the edges of what stands off the ground.
COMPARED_WIDTH, SMOOTHED_PX = 480, 2.0
# Values this dark or bright say nothing about exposure.
EXPOSED = (16, 240)
# Fewer places than this that two cameras see say nothing.
LEAST_PLACES = 100
# Logarithms. What is left between two cameras at a place, and how many places of a pair are as good as independent.
NOISE, INDEPENDENT = 0.05, 20
# How far log gains, contrasts and falloffs are expected from 0: cameras of one rig are alike.
GAIN_SIGMA, CONTRAST_SIGMA, FALLOFF_SIGMA = 0.3, 0.1, 0.1
# Beyond this it is no matter of exposure.
LARGEST_GAIN, LARGEST_CONTRAST, LARGEST_FALLOFF = 1.5, 0.3, 0.4
# The grey level that a contrast leaves as it is.
MIDDLE = 100.0
# How much of a new estimate counts beside what was kept.
NEW_SHARE = 0.25
ROUNDS = 12
UNKNOWNS = 5
# Residuals beyond so many of their own scales are players, and what else two cameras see differently.
ROBUST = 2.0


@dataclass(frozen=True)
class Light:
    """What is done to a camera's picture so that it agrees with the others'.

    `gain`: by what a middling blue, green and red (`MIDDLE`) is multiplied. `contrast`: how much steeper its tones
    become, an exponent less 1, since makers bend them differently. `falloff`: the logarithm of how much more the
    corners are multiplied by than the middle; it rises with the square of the distance from the middle of the frame,
    which stands for the optical axis.
    """

    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    contrast: float = 0.0
    falloff: float = 0.0

    @property
    def tones(self) -> NDArray[np.float32]:
        """What blue, green and red of each grey level 0 to 255 become in the middle of the frame, (256, 3)."""
        tone = MIDDLE * (np.arange(256) / MIDDLE) ** (1 + self.contrast)
        return (tone[:, None] * np.array(self.gain)).astype(np.float32)

    def rise(self, pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
        """By what pixels (..., 2) of a frame of `size` (width, height) are multiplied beside."""
        return np.exp(np.float32(self.falloff) * squared_radius(pixels, size))

    def after(self, before: Light | None) -> Light:
        """This one, steadied by the `before`: a cloud moves a picture by a part of what it moved the light."""
        if before is None:
            return self
        old, new = before.numbers, self.numbers
        return Light.of(old + NEW_SHARE * (new - old))

    @property
    def numbers(self) -> Array:
        """Log gains of blue, green and red, contrast, falloff (5,)."""
        return np.array([*np.log(self.gain), self.contrast, self.falloff])

    @classmethod
    def of(cls, numbers: Array) -> Light:
        """From its `numbers`."""
        blue, green, red = np.exp(numbers[:3]).tolist()
        return cls((blue, green, red), float(numbers[3]), float(numbers[4]))


NEUTRAL = Light()


def squared_radius(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Squares (...) of the distances of pixels (..., 2) from the middle of a frame, 1 in its corners."""
    half = (np.array(size, np.float32) - 1) / 2
    offset = (pixels - half) / np.float32(np.hypot(*half))
    square: NDArray[np.float32] = np.sum(offset * offset, axis=-1)
    return square


def lights(pitch: Field, cameras: Sequence[Camera], frames: Mapping[str, Frame]) -> dict[str, Light]:
    """What makes the cameras agree where they overlap, by camera; none of one that overlaps no other.

    Least squares of the logarithms of what two cameras show of the same places, robust to players and to whatever
    stands off the ground; held near no correction at all, so that only differences follow the pictures.
    """
    if len(cameras) < 2:
        return {}
    view = chosen_view(pitch, cameras, ViewChoice(width=COMPARED_WIDTH))
    width, height = view.size
    points = view.behind(pitch, np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float))
    seen = [_seen(camera, frames[camera.id], points) for camera in cameras]
    overlaps = [
        _Overlap.of(i, j, seen)
        for i, j in combinations(range(len(cameras)), 2)
        if np.count_nonzero(seen[i].valid & seen[j].valid) >= LEAST_PLACES
    ]
    limits = np.array([*3 * [math.log(LARGEST_GAIN)], LARGEST_CONTRAST, LARGEST_FALLOFF])
    found = np.clip(_solved(overlaps, len(cameras)), -limits, limits)
    overlapping = sorted({n for overlap in overlaps for n in overlap.cameras})
    return {cameras[n].id: Light.of(found[n]) for n in overlapping}


@dataclass(frozen=True)
class _Seen:
    """What a camera shows of places (H, W): logarithms (H, W, 3), where it does, squared distances from the middle."""

    logs: NDArray[np.float32]
    valid: NDArray[np.bool_]
    radius: NDArray[np.float32]


def _seen(camera: Camera, frame: Frame, points: Array) -> _Seen:
    pixels = camera.project(points)
    size = camera.intrinsics.size
    within = inside(pixels, size)
    values = sampled(frame, pixels, within).astype(np.float32)
    exposed = within & (values.min(axis=-1) > EXPOSED[0]) & (values.max(axis=-1) < EXPOSED[1])
    share, total = (
        cv2.GaussianBlur(part, (0, 0), SMOOTHED_PX)
        for part in (exposed.astype(np.float32), np.where(exposed[..., None], np.log(np.maximum(values, 1)), 0))
    )
    logs: NDArray[np.float32] = (np.asarray(total) / np.maximum(np.asarray(share), 1e-6)[..., None]).astype(np.float32)
    radius = squared_radius(np.nan_to_num(pixels).astype(np.float32), size)
    every = slice(None, None, round(SMOOTHED_PX))
    return _Seen(logs[every, every], (exposed & (np.asarray(share) > 0.5))[every, every], radius[every, every])


@dataclass(frozen=True)
class _Overlap:
    """What two cameras say of each other: `design` (n, 10) times the numbers of both should be `difference` (n,).

    A row for each colour of each place; log gains of blue, green and red, contrast and falloff of either.
    """

    cameras: tuple[int, int]
    design: Array
    difference: Array

    @classmethod
    def of(cls, i: int, j: int, seen: Sequence[_Seen]) -> _Overlap:
        """Of cameras number i and j."""
        both = seen[i].valid & seen[j].valid
        design = np.zeros((np.count_nonzero(both), 3, 2, UNKNOWNS))
        for side, (camera, sign) in enumerate(((i, 1), (j, -1))):
            for colour in range(3):
                design[:, colour, side, colour] = sign
            design[:, :, side, 3] = sign * (seen[camera].logs[both] - math.log(MIDDLE))
            design[:, :, side, 4] = sign * seen[camera].radius[both][:, None]
        difference = (seen[j].logs - seen[i].logs)[both].astype(float)
        return cls((i, j), design.reshape(-1, 2 * UNKNOWNS), difference.reshape(-1))

    @property
    def columns(self) -> NDArray[np.intp]:
        """Where its unknowns are among those of all cameras."""
        return np.concatenate([UNKNOWNS * n + np.arange(UNKNOWNS) for n in self.cameras])


def _solved(overlaps: Sequence[_Overlap], count: int) -> Array:
    """Log gains of blue, green and red, contrast and falloff of each camera, (count, 5)."""
    sigma = np.tile([*3 * [GAIN_SIGMA], CONTRAST_SIGMA, FALLOFF_SIGMA], count)
    solution: Array = np.zeros(UNKNOWNS * count)
    for _ in range(ROUNDS):
        normal, right = np.diag(1 / np.square(sigma)).astype(float), np.zeros(UNKNOWNS * count)
        for overlap in overlaps:
            columns, design = overlap.columns, overlap.design
            residual = overlap.difference - design @ solution[columns]
            scale = max(1.4826 * float(np.median(np.abs(residual))), 1e-3)
            weight = 1 / np.maximum(1, np.abs(residual) / (ROBUST * scale)) ** 2
            weight *= INDEPENDENT / NOISE**2 / weight.sum()
            normal[np.ix_(columns, columns)] += design.T @ (weight[:, None] * design)
            right[columns] += design.T @ (weight * overlap.difference)
        solution = np.asarray(np.linalg.solve(normal, right), float)
    return solution.reshape(count, UNKNOWNS)
