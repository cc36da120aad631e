"""Lines of a frame as its lens lays them out: segments, places on paint, distances to paint."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens
from worker.calibration.relocalisation.view_surface import ViewSurface, surface_of

WIDTH_PX = 480
"""Width of a frame in view pixels: hypotheses differ by as little as half a pixel of it."""


@dataclass(frozen=True)
class LineView:
    """Lines of one frame in view pixels on a `surface`: undistorted, origin in the principal point, x right, y down.

    `focal_px`: of the lens that undistorted it, in view pixels; another focal length f sees the same picture along
    other rays, on a plane (x / f, y / f, 1). `places` (M, 2) on the middles of paint; `painted_px`: their length in
    all; `distance` (H, W) to the nearest of them, which is at `nearest` (H, W, 2), column and row, and `covered` (H, W)
    what the frame covers, from `corner` (2,) on; `starts`, `ends` (S, 2) of straight segments. `roll_sigma`: how far
    from level the camera may be rolled, rad, one standard deviation.
    """

    surface: ViewSurface
    focal_px: float
    frame_px: float
    places: NDArray[np.float32]
    painted_px: float
    distance: NDArray[np.float32]
    nearest: NDArray[np.float32]
    covered: NDArray[np.bool_]
    corner: Array
    starts: Array
    ends: Array
    roll_sigma: float

    @classmethod
    def of(cls, response: NDArray[np.uint8], lens: Lens, roll_sigma_deg: float) -> "LineView":
        """Return the view of a response (height, width), 0..255, of the network through `lens`."""
        width, height = lens.size
        scale = WIDTH_PX / width
        focal = lens.focal_length_px * scale
        small = np.asarray(
            cv2.resize(response, (2 * WIDTH_PX, round(2 * height * scale)), interpolation=cv2.INTER_AREA), np.uint8
        )
        surface = surface_of(lens)
        border = surface.outline() * focal
        # Limit of undistorted views from the principal point, in widths of a frame.
        widest = 1.3
        low = np.maximum(border.min(axis=0), -widest * WIDTH_PX)
        high = np.minimum(border.max(axis=0), widest * WIDTH_PX)
        shape = tuple(np.floor(high - low).astype(int)[::-1] + 1)
        cells = _cells(_laid_out(middles_of_paint(small) / (2 * scale), surface, focal) - low, shape)
        free = np.ones(shape, np.uint8)
        free[cells[:, 1], cells[:, 0]] = 0
        covered = np.zeros(shape, np.uint8)
        cv2.fillPoly(covered, [np.rint(border - low).astype(np.int32)], 1)
        distance, label = cv2.distanceTransformWithLabels(free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        # Number of places on paint that each pose of a population projects to the ground.
        chosen = np.random.default_rng(1).permutation(len(cells))[:320]
        starts, ends = _segments(small, surface, focal, 2 * scale)
        return cls(
            surface,
            focal,
            1 / scale,
            (cells[chosen] + low).astype(np.float32),
            float(len(cells)),
            np.minimum(distance, 60.0).astype(np.float32),
            labelled_places(np.asarray(label), free),
            covered.astype(bool),
            low,
            starts,
            ends,
            float(np.radians(roll_sigma_deg)),
        )

    @property
    def thinned(self) -> "LineView":
        """The view with a quarter of its places on paint, to rank many hypotheses by."""
        return replace(self, places=self.places[::4])

    @property
    def lengths(self) -> Array:
        """Lengths (S,) of the segments, view pixels."""
        return np.asarray(np.linalg.norm(self.ends - self.starts, axis=1))

    def to_paint(self, places: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the vectors from places (..., 2) to the nearest paint, view pixels, and True inside the frame."""
        height, width = self.covered.shape
        at = places - self.corner
        column, row = (
            np.clip(np.rint(at[..., axis]), 0, most - 1).astype(int) for axis, most in ((0, width), (1, height))
        )
        inside = (np.abs(at - np.stack([column, row], axis=-1)) <= 0.5).all(axis=-1)
        return self.nearest[row, column] - at, inside & self.covered[row, column]

    def normals(self, focal_px: Array) -> Array:
        """Return unit normals (..., S, 3), in the camera's frame, of the planes through the camera and each segment.

        For focal lengths (...).
        """
        normal = self.surface.normals(self.starts, self.ends, focal_px)
        return _unit(normal)

    def planes(self, focal_px: Array) -> tuple[Array, Array]:
        """Return these unit normals and the unit rays to the middles of the segments, both (F, S, 3)."""
        middles = self.surface.rays(tuple((self.starts + self.ends).T / 2), focal_px[:, None])
        return self.normals(focal_px), _unit(np.stack(np.broadcast_arrays(*middles), axis=-1))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _laid_out(pixels: Array, surface: ViewSurface, focal: float) -> Array:
    """Return pixels (n, 2) of a frame in view pixels; those without a ray are left out."""
    places = surface.lay_out(pixels) * focal
    return np.asarray(places[np.isfinite(places).all(axis=-1)])


def labelled_places(label: NDArray[Any], free: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return column and row (H, W, 2) of the painted cell, where `free` is 0, of each cell's label."""
    row, column = np.nonzero(free == 0)
    of_label = np.zeros((int(label.max()) + 1, 2), np.float32)
    of_label[label[row, column]] = np.stack([column, row], axis=1)
    return of_label[label]


def middles_of_paint(small: NDArray[np.uint8]) -> Array:
    """Return pixels (n, 2) of the shrunk response on the middles of what is painted."""
    # Response, 0..255, from which a pixel of the shrunk response is paint.
    depth = cv2.distanceTransform((small > 110).astype(np.uint8), cv2.DIST_L2, 5)
    middle = (depth > 0) & (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8)) - 0.25)
    row, column = np.nonzero(middle)
    return np.stack([column, row], axis=1).astype(float)


def _cells(places: Array, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the cells (n, 2), column and row, of places, each once."""
    cells = np.rint(places).astype(np.intp)
    within = (cells >= 0).all(axis=1) & (cells < shape[::-1]).all(axis=1)
    return np.unique(cells[within], axis=0)


def _segments(small: NDArray[np.uint8], surface: ViewSurface, focal: float, scale: float) -> tuple[Array, Array]:
    """Return starts and ends (S, 2) of the longest straight segments, view pixels (von Gioi et al., LSD, 2012)."""
    found = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD).detect(small)[0]
    pixels = (np.zeros((0, 4)) if found is None else found.reshape(-1, 4)) / scale
    starts, ends = (surface.lay_out(pixels[:, part].astype(float)) * focal for part in (slice(0, 2), slice(2, 4)))
    length = np.linalg.norm(ends - starts, axis=1)
    longest = np.argsort(-np.nan_to_num(length))[:140]
    longest = longest[np.nan_to_num(length[longest]) >= 10.0]
    return starts[longest], ends[longest]
