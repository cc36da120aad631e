"""Photometric alignment of cameras in a stitched view by the places that several of them show, and its best seams."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import quality, sampled
from worker.calibration.stitching.photometry import MIDDLE, Light, squared_radius
from worker.calibration.stitching.views import ViewChoice, chosen_view

# Values this dark or bright say nothing about exposure.
EXPOSED = (16, 240)
# A larger gain is no matter of exposure.
LARGEST_GAIN = 1.5
UNKNOWNS = 5


def evened_out(pitch: Field, cameras: Sequence[Camera], frames: Mapping[str, Frame]) -> dict[str, Light]:
    """Return the corrections that make the cameras agree where they overlap, by camera, if it overlaps any.

    Least squares of the logarithms of what two cameras show of the same places, robust to players and to whatever
    stands off the ground; held near no correction at all, so that only differences follow the pictures. The seams then
    go where the cameras differ least: past what moves, and past what stands so near that each sees it elsewhere.
    """
    if len(cameras) < 2:
        return {}
    view = chosen_view(pitch, cameras, ViewChoice(width=240))
    width, height = view.size
    points = view.behind(pitch, np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float))
    seen = [_seen(camera, frames[camera.id], points) for camera in cameras]
    # Fewer places than this that two cameras see say nothing.
    overlaps = [
        _Overlap.of(i, j, seen)
        for i, j in combinations(range(len(cameras)), 2)
        if np.count_nonzero(seen[i].valid & seen[j].valid) >= 100
    ]
    limits = np.array([*3 * [math.log(LARGEST_GAIN)], 0.3, 0.4])
    numbers = np.clip(_solved(overlaps, len(cameras)), -limits, limits)
    reaches = _reaches(overlaps, seen, numbers)
    overlapping = sorted({n for overlap in overlaps for n in overlap.cameras})
    return {cameras[n].id: Light.of(np.append(numbers[n], reaches[n])) for n in overlapping}


@dataclass(frozen=True)
class _Seen:
    """Logarithms (H, W, 3) of places by a camera, where valid; squared distances from the middle; how well it sees."""

    logs: NDArray[np.float32]
    valid: NDArray[np.bool_]
    radius: NDArray[np.float32]
    quality: NDArray[np.float32]

    def evened(self, numbers: Array) -> Array:
        """Return the logarithms with log gains, contrast and falloff (5,) applied."""
        changed = self.logs + numbers[:3] + numbers[3] * (self.logs - math.log(MIDDLE))
        return np.asarray(changed + numbers[4] * self.radius[..., None], float)


def _seen(camera: Camera, frame: Frame, points: Array) -> _Seen:
    pixels = camera.project(points)
    size = camera.intrinsics.size
    within = inside(pixels, size)
    values = sampled(frame, pixels, within).astype(np.float32)
    exposed = within & (values.min(axis=-1) > EXPOSED[0]) & (values.max(axis=-1) < EXPOSED[1])
    # Neither noise nor the edges of what stands off the ground.
    smoothed_px = 1.0
    share, total = (
        cv2.GaussianBlur(part, (0, 0), smoothed_px)
        for part in (exposed.astype(np.float32), np.where(exposed[..., None], np.log(np.maximum(values, 1)), 0))
    )
    logs: NDArray[np.float32] = (np.asarray(total) / np.maximum(np.asarray(share), 1e-6)[..., None]).astype(np.float32)
    radius = squared_radius(np.nan_to_num(pixels).astype(np.float32), size)
    return _Seen(logs, exposed & (np.asarray(share) > 0.5), radius, quality(size, pixels))


@dataclass(frozen=True)
class _Overlap:
    """Equations of two cameras: `design` (n, 10) times the parameters of both should be `difference` (n,).

    A row for each colour of each place; log gains of blue, green and red, contrast and falloff of either.
    """

    cameras: tuple[int, int]
    design: Array
    difference: Array

    @classmethod
    def of(cls, i: int, j: int, seen: Sequence[_Seen]) -> "_Overlap":
        """Return the equations of cameras number i and j."""
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
        """Indices of its unknowns among those of all cameras."""
        return np.concatenate([UNKNOWNS * n + np.arange(UNKNOWNS) for n in self.cameras])


def _solved(overlaps: Sequence[_Overlap], count: int) -> Array:
    """Return log gains of blue, green and red, contrast and falloff of each camera, (count, 5)."""
    # Cameras of one rig are alike.
    sigma = np.tile([*3 * [0.3], 0.1, 0.1], count)
    solution: Array = np.zeros(UNKNOWNS * count)
    for _ in range(12):
        normal, right = np.diag(1 / np.square(sigma)).astype(float), np.zeros(UNKNOWNS * count)
        for overlap in overlaps:
            columns, design = overlap.columns, overlap.design
            residual = overlap.difference - design @ solution[columns]
            scale = max(1.4826 * float(np.median(np.abs(residual))), 1e-3)
            # Residuals beyond so many of their own scales are players, and what else two cameras see differently.
            weight = 1 / np.maximum(1, np.abs(residual) / (2.0 * scale)) ** 2
            # So many places of a pair are as good as independent.
            weight *= 20 / 0.05**2 / weight.sum()
            normal[np.ix_(columns, columns)] += design.T @ (weight[:, None] * design)
            right[columns] += design.T @ (weight * overlap.difference)
        solution = np.asarray(np.linalg.solve(normal, right), float)
    return solution.reshape(count, UNKNOWNS)


def _reaches(overlaps: Sequence[_Overlap], seen: Sequence[_Seen], numbers: Array) -> Array:
    """Return the reach of each camera that brings the seam of each pair to where the two differ least."""
    normal, right = np.eye(len(seen)), np.zeros(len(seen))
    seam_sigma = 0.2
    for overlap in overlaps:
        i, j = overlap.cameras
        sign = np.zeros(len(seen))
        sign[[i, j]] = -1, 1
        normal += np.outer(sign, sign) / seam_sigma**2
        right += sign * _best_seam(seen[i], seen[j], numbers[i], numbers[j]) / seam_sigma**2
    return np.asarray(np.linalg.solve(normal, right), float)


def _best_seam(first: _Seen, second: _Seen, by_first: Array, by_second: Array) -> float:
    """Return the log ratio of how well two cameras see along which their evened pictures differ least."""
    both = first.valid & second.valid
    ratio = np.log(first.quality[both] / second.quality[both])
    apart = np.abs(first.evened(by_first) - second.evened(by_second)).mean(axis=-1)[both]
    costs = []
    # Log ratios of how well two cameras see at which seams are tried.
    seams = np.linspace(-1.5, 1.5, 31)
    # Log differences above this are all alike: somebody stands there.
    outright = 0.7
    for seam in seams:
        along = np.abs(ratio - seam) < 0.2
        differing = np.minimum(apart[along], outright).mean() if along.any() else outright
        # A seam is moved for a difference that grows with its square: most of both pictures is left where it is seen
        # best.
        costs.append(differing + 0.005 * seam**2)
    return float(seams[np.argmin(costs)])
