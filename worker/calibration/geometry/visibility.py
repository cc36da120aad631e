"""Visible points of the markings, and their size in a camera's picture."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.arrays import Array, take_rows
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import LinePoints


@dataclass(frozen=True)
class VisibleLines:
    """Line points as one camera sees them, N of them.

    `index` (N,): which of the given line points; `points`: those points in the world; `pixel` (N, 2): their projection;
    `normal` (N, 2): the unit vector across the line in the picture, towards `points.normal`; `width_px` (N,) of the
    line along that normal; `length_px` (N,) of line that the point stands for; `px_per_metre` (N,): how far the line
    moves along its normal in the picture when it moves one metre across itself on the ground, and
    `px_per_metre_up` (N,): when the ground under it rises by one metre.
    """

    index: NDArray[np.intp]
    points: LinePoints
    pixel: Array
    normal: Array
    width_px: Array
    length_px: Array
    px_per_metre: Array
    px_per_metre_up: Array

    @classmethod
    def from_camera(cls, lines: LinePoints, camera: Camera) -> "VisibleLines":
        """Return the line points that fall into the picture."""
        pixel = camera.project(lines.position)
        index = np.flatnonzero(camera.sees(pixel))
        lines, pixel = lines[index], pixel[index]
        step_m = 0.05
        along = (camera.project(lines.position + step_m * lines.tangent) - pixel) / step_m
        across = (camera.project(lines.position + step_m * lines.normal) - pixel) / step_m
        up = (camera.project(lines.position + [0.0, 0.0, step_m]) - pixel) / step_m
        speed = np.linalg.norm(along, axis=1)
        # A line seen end-on has no direction in the picture, and a point at the rim of the lens none that is known.
        usable = np.isfinite(across + up).all(axis=1) & np.isfinite(speed) & (speed > 1e-6)
        index, lines = index[usable], lines[usable]
        pixel, along, across, up, speed = (a[usable] for a in (pixel, along, across, up, speed))
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / speed[:, None]
        px_per_metre = np.sum(across * normal, axis=1)
        normal = np.where(px_per_metre[:, None] < 0, -normal, normal)
        px_per_metre = np.abs(px_per_metre)
        px_per_metre_up = np.sum(up * normal, axis=1)
        return cls(
            index,
            lines,
            pixel,
            normal,
            lines.width * px_per_metre,
            speed * lines.spacing,
            px_per_metre,
            px_per_metre_up,
        )

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "VisibleLines":
        return take_rows(self, chosen)

    def thinned(self, spacing_px: float) -> "VisibleLines":
        """Return about one point every `spacing_px` along the lines; each stands for the length of those dropped."""
        walked = np.cumsum(self.length_px)
        kept = np.flatnonzero(np.diff(np.floor(walked / spacing_px), prepend=-1.0) > 0)
        few = self[kept]
        length = np.maximum(np.diff(walked[kept], prepend=0.0), few.length_px)
        return replace(few, length_px=length)
