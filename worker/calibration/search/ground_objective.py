"""The paper's objective to the letter: segmentations warped to a bird's-eye grid of 10 cm, counts above 0.5.

Kept for comparison. It is slow, its landscape is steep, and the far half of the pitch, mostly noise there, counts as
much as the near one; `objective` says what the preset `esc` does instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, rotation_matrices
from worker.calibration.scene.field import Field
from worker.calibration.see.sampling import bilinear

PIXELS_PER_METRE = 10.0
TEMPLATE_BLURS_PX = (1.0, 2.0, 4.0)
"""Radii of the blurs that make up the template; the paper does not give them."""
MARGIN_M = 2.0
LARGEST_UNDISTORTED = 2.5
"""Undistorted frames are cut where they would be wider than this many times the frame."""

Binary = NDArray[np.uint8]


class GroundObjective:
    """L = w L_stitch + (1 - w) / N sum L_single with the paper's IoU of warped segmentations (equations 2 to 4).

    Every term is 1 - IoU. A term counts only where the poses at the start saw the ground, else the best pose would be
    the one that turns away from hard lines.
    """

    def __init__(
        self,
        pitch: Field,
        cameras: Sequence[Camera],
        responses: Sequence[NDArray[np.float32]],
        stitch_weight: float,
    ) -> None:
        """`cameras` carry the stored poses; `responses` are their segmentations (H, W) in 0..1."""
        grid = _Grid.covering(pitch)
        template = grid.template(pitch)
        domains = [grid.visible(camera) for camera in cameras]
        self.warps = [
            _Warp.build(grid, _PinholeView.build(camera, response), domain)
            for camera, response, domain in zip(cameras, responses, domains, strict=True)
        ]
        self.templates = [template & domain for domain in domains]
        self.pairs = {
            (i, j): domains[i] & domains[j]
            for i, j in combinations(range(len(cameras)), 2)
            if (domains[i] & domains[j] & template).any()
        }
        self.stitch_weight = stitch_weight if self.pairs else 0.0

    def losses(self, genomes: Array) -> Array:
        """Losses (P,) of genomes (P, 6 N): per camera its rotation vector and position.

        One warp per individual and camera: OpenCV's warp with its own threads is faster here than any array operation
        over 700 000 grid points of a whole population.
        """
        poses = genomes.reshape(len(genomes), -1, 2, 3)
        matrices = rotation_matrices(poses[:, :, 0])
        return np.array([self._loss(r, p) for r, p in zip(matrices, poses[:, :, 1], strict=True)])

    def _loss(self, rotations: Array, positions: Array) -> float:
        warped = [warp(r, p) for warp, r, p in zip(self.warps, rotations, positions, strict=True)]
        single = np.mean([_unlike(seen, template) for seen, template in zip(warped, self.templates, strict=True)])
        if self.stitch_weight == 0:
            return float(single)
        stitch = np.mean([_unlike(warped[i] & both, warped[j] & both) for (i, j), both in self.pairs.items()])
        return float(self.stitch_weight * stitch + (1 - self.stitch_weight) * single)


def _unlike(a: Binary, b: Binary) -> float:
    """1 - IoU of two binary pictures."""
    either = cv2.countNonZero(a | b)
    return 1.0 - cv2.countNonZero(a & b) / either if either else 1.0


@dataclass(frozen=True)
class _PinholeView:
    """An undistorted segmentation above 0.5 and the matrix (3, 3) of its pinhole camera."""

    marked: NDArray[np.uint8]
    matrix: Array

    @classmethod
    def build(cls, camera: Camera, response: NDArray[np.float32]) -> _PinholeView:
        """Undistort a response (H, W) onto as large a picture as holds all of it, at the frame's focal length."""
        lens = camera.intrinsics
        width, height = lens.size
        border = np.concatenate(
            [
                np.stack([np.linspace(0, width - 1, 50), np.full(50, y)], axis=1)
                for y in (0.0, (height - 1) / 2, height - 1.0)
            ]
        )
        rays = lens.undistort(border)
        left_top = np.maximum(np.nanmin(rays, axis=0) * lens.matrix[0, 0], [-LARGEST_UNDISTORTED * width / 2] * 2)
        right_bottom = np.minimum(np.nanmax(rays, axis=0) * lens.matrix[0, 0], [LARGEST_UNDISTORTED * width / 2] * 2)
        matrix = np.array([[lens.matrix[0, 0], 0, -left_top[0]], [0, lens.matrix[0, 0], -left_top[1]], [0, 0, 1]])
        size = np.ceil(right_bottom - left_top).astype(int) + 1
        x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        plane = (np.stack([x, y], axis=-1) + left_top) / lens.matrix[0, 0]
        undistorted = bilinear(response, lens.distort(plane))
        return cls(np.rint(undistorted * 255).astype(np.uint8), matrix)


@dataclass(frozen=True)
class _Grid:
    """Bird's-eye grid: pixel (column, row) is the ground point `origin` + (column, row) / `PIXELS_PER_METRE`.

    The roof is made of planes z = plane . (x, y, 1), and a plane is seen through a homography: `planes` (K, 3) with the
    mask of the grid points that lie on each. `surface` (H, W, 3): all its points.
    """

    origin: Array
    size: tuple[int, int]
    planes: Array
    on_plane: list[Binary]
    surface: Array

    @classmethod
    def covering(cls, pitch: Field) -> _Grid:
        origin = -np.array([pitch.length / 2 + MARGIN_M, pitch.width / 2 + MARGIN_M])
        size = (int(-2 * origin[0] * PIXELS_PER_METRE) + 1, int(-2 * origin[1] * PIXELS_PER_METRE) + 1)
        columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        surface = pitch.lift(origin + np.stack([columns, rows], axis=-1) / PIXELS_PER_METRE)
        planes, masks = _planes(surface)
        return cls(origin, size, planes, masks, surface)

    def visible(self, camera: Camera) -> Binary:
        """255 where `camera` sees the ground."""
        pixels = camera.project(self.surface.reshape(-1, 3))
        seen = camera.sees(pixels)
        return (255 * seen).astype(np.uint8).reshape(self.size[::-1])

    def template(self, pitch: Field) -> Binary:
        """The paper's T above 0.5: white lines on black, several blurs of different radius combined."""
        lines = np.zeros(self.size[::-1], dtype=np.float32)
        for marking in pitch.markings():
            pixels = np.rint((marking.centre - self.origin) * PIXELS_PER_METRE * 16).astype(np.int32)
            cv2.polylines(lines, [pixels], False, 1.0, 1, shift=4)
        blurs = [cv2.GaussianBlur(lines, (0, 0), radius) for radius in TEMPLATE_BLURS_PX]
        combined = np.mean([blur / blur.max() for blur in blurs], axis=0)
        return (255 * (combined > 0.5)).astype(np.uint8)


@dataclass(frozen=True)
class _Warp:
    """A view's markings above 0.5 on the grid, where the camera saw the ground at the start.

    One entry per plane of the roof: left and top of the box that holds what is seen of it, the mask (h, w) in that box,
    and the matrix (4, 3) that lifts a pixel of the box to a point (x, y, z, 1) of the plane.
    """

    view: _PinholeView
    shape: tuple[int, int]
    boxes: list[tuple[int, int, Binary, Array]]

    @classmethod
    def build(cls, grid: _Grid, view: _PinholeView, domain: Binary) -> _Warp:
        boxes = []
        for plane, on_plane in zip(grid.planes, grid.on_plane, strict=True):
            mask = on_plane & domain
            left, top, width, height = cv2.boundingRect(mask)
            if width == 0:
                continue
            corner = grid.origin + np.array([left, top]) / PIXELS_PER_METRE
            to_ground = np.array(
                [[1 / PIXELS_PER_METRE, 0, corner[0]], [0, 1 / PIXELS_PER_METRE, corner[1]], [0, 0, 1]]
            )
            lift = np.array([[1, 0, 0], [0, 1, 0], plane, [0, 0, 1]]) @ to_ground
            boxes.append((left, top, mask[top : top + height, left : left + width].copy(), lift))
        return cls(view, domain.shape, boxes)

    def __call__(self, rotation: Array, position: Array) -> Binary:
        """255 where a marking falls, for a rotation (3, 3) and a position (3,)."""
        projection = self.view.matrix @ rotation @ np.column_stack([np.eye(3), -position])
        ground = np.zeros(self.shape, dtype=np.uint8)
        for left, top, mask, lift in self.boxes:
            height, width = mask.shape
            seen = cv2.warpPerspective(
                self.view.marked, projection @ lift, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            )
            ground[top : top + height, left : left + width] |= np.asarray(seen, dtype=np.uint8) & mask
        return np.asarray(cv2.threshold(ground, 127, 255, cv2.THRESH_BINARY)[1], dtype=np.uint8)


def _planes(surface: Array) -> tuple[Array, list[Binary]]:
    """The planes (K, 3) that a lifted grid (H, W, 3) is made of, and for each the mask of its points."""
    slope_y, slope_x = np.gradient(surface[..., 2], 1 / PIXELS_PER_METRE)
    offset = surface[..., 2] - slope_x * surface[..., 0] - slope_y * surface[..., 1]
    keys = np.round(np.stack([slope_x, slope_y, offset], axis=-1), 6)
    planes, counts = np.unique(keys.reshape(-1, 3), axis=0, return_counts=True)
    # Grid points astride an edge have the mean slope of two planes: they belong to the nearer of the real ones.
    planes = planes[counts > 0.01 * counts.sum()]
    homogeneous = np.concatenate([surface[..., :2], np.ones((*surface.shape[:2], 1))], axis=-1)
    nearest = np.argmin(np.abs(homogeneous @ planes.T - surface[..., 2:]), axis=-1)
    return planes, [(255 * (nearest == number)).astype(np.uint8) for number in range(len(planes))]
