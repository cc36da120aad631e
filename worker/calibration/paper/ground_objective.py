"""The paper's objective (section III): segmentations warped to a bird's-eye grid, IoU of what is above 0.5 there.

The paper's template combines several, "each one of them blurred with a Gaussian function of a different radius", so
that the loss is smooth; it says neither which nor how. Blurs summed to one template and cut at 0.5 are one broad line:
nothing pulls from beyond it, and nothing within says where its middle is. Here each blur has an IoU of its own, of
template and segmentation blurred alike, and the loss is their mean: broad lines pull from afar, narrow ones are exact.

What is segmented far from any line of the template, other pitches' lines above all, is in no union: it would be there
whatever the pose, and drown what the pose changes. Cameras with each other are compared wherever both see.

Kept for comparison: the far half of the pitch, mostly noise there, counts as much as the near one.
`search/objective.py` says what ESC does instead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import ceil
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_profile import blurred_line
from worker.calibration.detection.sampling import bilinear
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import halved
from worker.calibration.geometry.rotation import rotation_matrices

PIXELS_PER_METRE = 10.0
COARSEST = 32
"""Side, in pixels, of the square that may be one pixel on the coarsest grid."""

Picture = NDArray[np.uint8]
"""Grey picture, or a mask that is 0 where it is not."""
Grey = NDArray[np.float32]


@dataclass(frozen=True)
class Blurs:
    """Gaussians, each twice as broad as the one before: `sigma_px` of grids that are 2, 4, 8 ... times as coarse."""

    sigma_px: float
    count: int


BROAD = Blurs(1.5, 5)
"""Blurs from 30 cm to 4.8 m, which pull from two degrees away."""
NARROW = Blurs(0.7, 2)
"""Blurs of 14 and 28 cm, about a line, which are exact."""


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
        blurs: Blurs,
    ) -> None:
        """Take `cameras` with their stored poses, and `responses`, their segmentations (H, W) in 0..1."""
        self.blurs = blurs
        whole = _Grid.covering(pitch)
        window = _window([whole.visible(camera) for camera in cameras])
        grid, lines = whole.within(window), whole.lines(pitch)[window]
        domains = [grid.visible(camera) for camera in cameras]
        self.warps = [
            _Warp.build(grid, _PinholeView.build(camera, response), domain)
            for camera, response, domain in zip(cameras, responses, domains, strict=True)
        ]
        widths_px = np.array([pitch.line_width * PIXELS_PER_METRE / 2**number for number in range(1, blurs.count + 1)])
        # Half of the brightness, of 255, of a line of the field after each blur.
        self.half_heights = [255 * height / 2 for height in blurred_line(widths_px, blurs.sigma_px)]
        self.templates = [self._thickened(lines & domain) for domain in domains]
        self.around = [_widened(template) for template in self.templates]
        self.pairs = {
            (i, j): _coarsened(domains[i] & domains[j], blurs.count)
            for i, j in combinations(range(len(cameras)), 2)
            if (domains[i] & domains[j] & lines).any()
        }
        self.stitch_weight = stitch_weight if self.pairs else 0.0

    def losses(self, genomes: Array) -> Array:
        """Return losses (P,) of genomes (P, 6 N): per camera its rotation vector and position.

        One warp per individual and camera: OpenCV's warp is faster here than any array operation over the grid points
        of a whole population.
        """
        poses = genomes.reshape(len(genomes), -1, 2, 3)
        matrices = rotation_matrices(poses[:, :, 0])
        return np.array([self._loss(r, p) for r, p in zip(matrices, poses[:, :, 1], strict=True)])

    def _loss(self, rotations: Array, positions: Array) -> float:
        seen = [self._thickened(warp(r, p)) for warp, r, p in zip(self.warps, rotations, positions, strict=True)]
        single = np.mean(
            [
                _unlike(_within(its, around), template)
                for its, template, around in zip(seen, self.templates, self.around, strict=True)
            ]
        )
        if self.stitch_weight == 0:
            return float(single)
        stitch = np.mean(
            [_unlike(_within(seen[i], both), _within(seen[j], both)) for (i, j), both in self.pairs.items()]
        )
        return float(self.stitch_weight * stitch + (1 - self.stitch_weight) * single)

    def _thickened(self, lines: Picture) -> list[Picture]:
        """Return, for each blur of lines (H, W), 1 where they are at least half as high as they should be."""
        return [
            _above(cv2.GaussianBlur(coarse, (0, 0), self.blurs.sigma_px, borderType=cv2.BORDER_CONSTANT), half)
            for coarse, half in zip(_pyramid(lines, self.blurs.count), self.half_heights, strict=True)
        ]


def _above(picture: Any, threshold: float) -> Picture:
    return np.greater(picture, threshold).view(np.uint8)


def _pyramid(picture: Picture, count: int) -> Iterator[Grey]:
    """Yield a picture (H, W) averaged over squares of 2, 4, 8 ... pixels a side."""
    # Once in bytes, which is fast; averages of broader squares would be rounded to nothing.
    coarse = halved(picture).astype(np.float32)
    yield coarse
    for _ in range(count - 1):
        coarse = halved(coarse)
        yield coarse


def _coarsened(domain: Picture, count: int) -> list[Picture]:
    """Return a mask (H, W) on the grids of `count` blurs."""
    return [_above(coarse, 255 / 2) for coarse in _pyramid(domain, count)]


def _widened(template: Sequence[Picture]) -> list[Picture]:
    """Return a template's blurred lines and what is beside them."""
    # Distance from a blurred line of the template up to which a union reaches, in pixels of the grid of that blur.
    reach_px = 8
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach_px + 1, 2 * reach_px + 1))
    return [np.asarray(cv2.dilate(lines, disc), dtype=np.uint8) for lines in template]


def _unlike(a: Sequence[Picture], b: Sequence[Picture]) -> float:
    """Return 1 - IoU of two binary pictures, the mean over their blurs."""
    both = [(cv2.countNonZero(one & other), cv2.countNonZero(one | other)) for one, other in zip(a, b, strict=True)]
    return float(np.mean([1.0 - common / either if either else 1.0 for common, either in both]))


def _within(pictures: Sequence[Picture], domain: Sequence[Picture]) -> list[Picture]:
    return [picture & its for picture, its in zip(pictures, domain, strict=True)]


@dataclass(frozen=True)
class _PinholeView:
    """Undistorted segmentation, 255 on a line, and the matrix (3, 3) of its pinhole camera."""

    marked: Picture
    matrix: Array

    @classmethod
    def build(cls, camera: Camera, response: NDArray[np.float32]) -> "_PinholeView":
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
        # Largest width of undistorted frames, in widths of the frame; wider ones are cut.
        largest_undistorted = 2.5
        left_top = np.maximum(np.nanmin(rays, axis=0) * lens.matrix[0, 0], [-largest_undistorted * width / 2] * 2)
        right_bottom = np.minimum(np.nanmax(rays, axis=0) * lens.matrix[0, 0], [largest_undistorted * width / 2] * 2)
        matrix = np.array([[lens.matrix[0, 0], 0, -left_top[0]], [0, lens.matrix[0, 0], -left_top[1]], [0, 0, 1]])
        size = np.ceil(right_bottom - left_top).astype(int) + 1
        x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        plane = (np.stack([x, y], axis=-1) + left_top) / lens.matrix[0, 0]
        undistorted = bilinear(response, lens.distort(plane))
        return cls((255 * (undistorted >= 0.5)).astype(np.uint8), matrix)


@dataclass(frozen=True)
class _Grid:
    """Bird's-eye grid: pixel (column, row) is the ground point `origin` + (column, row) / `PIXELS_PER_METRE`.

    The roof is made of planes z = plane . (x, y, 1), and a plane is seen through a homography: `planes` (K, 3) with the
    mask of the grid points that lie on each. `surface` (H, W, 3): all its points.
    """

    origin: Array
    size: tuple[int, int]
    planes: Array
    on_plane: list[Picture]
    surface: Array

    @classmethod
    def covering(cls, pitch: Field) -> "_Grid":
        margin_m = 2.0
        origin = -np.array([pitch.length / 2 + margin_m, pitch.width / 2 + margin_m])
        size = tuple(COARSEST * ceil(-2 * side * PIXELS_PER_METRE / COARSEST) for side in origin)
        columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        surface = pitch.lift(origin + np.stack([columns, rows], axis=-1) / PIXELS_PER_METRE)
        planes, masks = _planes(surface)
        return cls(origin, size, planes, masks, surface)

    def within(self, window: tuple[slice, slice]) -> "_Grid":
        """Return a part of the grid."""
        rows, columns = window
        size = (columns.stop - columns.start, rows.stop - rows.start)
        origin = self.origin + np.array([columns.start, rows.start]) / PIXELS_PER_METRE
        return _Grid(origin, size, self.planes, [mask[window] for mask in self.on_plane], self.surface[window])

    def visible(self, camera: Camera) -> Picture:
        """Return 255 where `camera` sees the ground, and a line would be a line."""
        seen = camera.sees(camera.project(self.surface))
        away = self.surface - camera.pose.position
        px_per_metre = camera.intrinsics.focal_length_px * -away[..., 2] / np.sum(away**2, axis=-1)
        # Least height in a 4K frame of a metre of ground, away from the camera, for it to count.
        near = px_per_metre >= 6.0 * camera.intrinsics.relative_size
        return (255 * (seen & near)).astype(np.uint8)

    def lines(self, pitch: Field) -> Picture:
        """Return white lines on black (H, W); a pixel that a line covers in part is grey."""
        points = pitch.line_points(0.02)
        line_samples = 6
        across = (np.arange(line_samples) + 0.5) / line_samples - 0.5
        covered = points.position[:, :2] + (across[:, None] * points.width)[..., None] * points.normal[:, :2]
        area = np.broadcast_to(points.spacing * points.width / line_samples, covered.shape[:2])
        edges = [np.arange(side + 1) - 0.5 for side in self.size[::-1]]
        column, row = ((covered - self.origin) * PIXELS_PER_METRE).reshape(-1, 2).T
        share = PIXELS_PER_METRE**2 * np.histogram2d(row, column, edges, weights=area.ravel())[0]
        return np.rint(255 * np.minimum(share, 1)).astype(np.uint8)


def _window(domains: Sequence[Picture]) -> tuple[slice, slice]:
    """Return rows and columns that hold what is seen of a grid (H, W), as many as the coarsest blur asks for."""
    left, top, *extent = cv2.boundingRect(np.bitwise_or.reduce(domains))
    slices = []
    for start, length, whole in zip((top, left), extent[::-1], domains[0].shape, strict=True):
        length = COARSEST * max(ceil(length / COARSEST), 1)
        start = min(start, whole - length)
        slices.append(slice(start, start + length))
    return slices[0], slices[1]


@dataclass(frozen=True)
class _Warp:
    """Warp of a view's segmentation onto the grid, where the camera saw the ground at the start.

    One entry per plane of the roof: left and top of the box that holds what is seen of it, the mask (h, w) in that box,
    and the matrix (4, 3) that lifts a pixel of the box to a point (x, y, z, 1) of the plane.
    """

    view: _PinholeView
    shape: tuple[int, int]
    boxes: list[tuple[int, int, Picture, Array]]

    @classmethod
    def build(cls, grid: _Grid, view: _PinholeView, domain: Picture) -> "_Warp":
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

    def __call__(self, rotation: Array, position: Array) -> Picture:
        """Return the grid (H, W), for a rotation (3, 3) and a position (3,)."""
        projection = self.view.matrix @ rotation @ np.column_stack([np.eye(3), -position])
        ground = np.zeros(self.shape, dtype=np.uint8)
        for left, top, mask, lift in self.boxes:
            height, width = mask.shape
            seen = cv2.warpPerspective(
                self.view.marked, projection @ lift, (width, height), flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
            )
            cv2.copyTo(seen, mask, ground[top : top + height, left : left + width])
        return ground


def _planes(surface: Array) -> tuple[Array, list[Picture]]:
    """Return the planes (K, 3) that a lifted grid (H, W, 3) is made of, and for each the mask of its points."""
    slope_y, slope_x = np.gradient(surface[..., 2], 1 / PIXELS_PER_METRE)
    offset = surface[..., 2] - slope_x * surface[..., 0] - slope_y * surface[..., 1]
    keys = np.round(np.stack([slope_x, slope_y, offset], axis=-1), 6)
    planes, counts = _distinct_rows(keys.reshape(-1, 3))
    # Grid points astride an edge have the mean slope of two planes: they belong to the nearer of the real ones.
    planes = planes[counts > 0.01 * counts.sum()]
    homogeneous = np.concatenate([surface[..., :2], np.ones((*surface.shape[:2], 1))], axis=-1)
    nearest = np.argmin(np.abs(homogeneous @ planes.T - surface[..., 2:]), axis=-1)
    return planes, [(255 * (nearest == number)).astype(np.uint8) for number in range(len(planes))]


def _distinct_rows(rows: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the distinct rows (K, n) of many (N, n), in their order, and how often each of them occurs (K,).

    np.unique sorts numbers twenty times as fast as rows.
    """
    places = [np.unique(column, return_inverse=True)[1] for column in rows.T]
    codes = np.ravel_multi_index(places, [int(place.max()) + 1 for place in places])
    _, first, counts = np.unique(codes, return_index=True, return_counts=True)
    return rows[first], counts
