"""A stitched view that stands still while its cameras move: the same view and seam, the maps follow the poses.

What changes from frame to frame is where a pixel of the view lies in the frames. That difference is smooth, so it is
computed at few places of the view, exactly, and interpolated: a hundredth of a new panorama's projections.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Camera, inside
from worker.calibration.geometry.field import Field
from worker.calibration.stitching.panorama import Contribution, Panorama, every_nth_pixel, every_pixel, panorama
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import StitchedView

STILL_BORDER = 0.02
"""Margin of a frame, in its widths, that is not shown, as it comes and goes with the shaking."""
VIEW_BORDER = 0.025
"""Margin, in widths of a frame, inside which a view ends without holes, also where stored poses are a little off."""


class MovingPanorama:
    """Panorama of a view by `cameras`, the references of a clip; `at` is that of other moments."""

    def __init__(
        self, pitch: Field, view: StitchedView, cameras: Sequence[Camera], lights: Mapping[str, Light] | None = None
    ) -> None:
        still = panorama(pitch, view, cameras, lights)
        self._still = Panorama(still.size, _within_frames(still.parts, still.seen, STILL_BORDER))
        # Approximate number of places across the view at which the motion is computed; the tests hold its error below
        # 0.05 px for a degree.
        self._step = max(1, view.size[0] // 320)
        self._points = view.behind(pitch, every_nth_pixel(view.size, self._step))
        self._before = [camera.project(self._points) for camera in cameras]
        self._used = [_used(part, self._step) for part in self._still.parts]

    def at(self, cameras: Sequence[Camera]) -> Panorama:
        """Return the panorama where the same cameras, in the same order, have moved by a degree or two."""
        motions = [
            filled((camera.project(self._points) - before).astype(np.float32))
            for before, camera in zip(self._before, cameras, strict=True)
        ]
        parts = [
            replace(part, source=part.source + every_pixel(motion, self._still.size, self._step))
            for part, motion in zip(self._still.parts, motions, strict=True)
        ]
        farthest = max(
            float(np.abs(motion[used]).max(initial=0.0)) / part.frame_size[0]
            for part, motion, used in zip(parts, motions, self._used, strict=True)
        )
        if farthest > STILL_BORDER:
            parts = _within_frames(parts, self._still.seen, margin=0.0)
        return Panorama(self._still.size, parts)


def _within_frames(parts: Sequence[Contribution], seen: NDArray[np.bool_], margin: float) -> list[Contribution]:
    """Return the parts without what lies outside of their frames, or nearer to the border than `margin` (of the width).

    Weights sum to 1 again where it was `seen` (H, W) before, wherever a camera is left that sees it.
    """
    weights = [
        np.where(inside(part.source, part.frame_size, margin * part.frame_size[0]), part.weight, np.float32(0))
        for part in parts
    ]
    total = np.sum(weights, axis=0)
    share = np.where(seen & (total > 0), 1 / np.maximum(total, 1e-6), np.float32(0)).astype(np.float32)
    return [replace(part, weight=weight * share) for part, weight in zip(parts, weights, strict=True)]


def _used(part: Contribution, step: int) -> NDArray[np.bool_]:
    """True for those of `every_nth_pixel` (h, w) that have to do with pixels where a camera counts."""
    reach = cv2.dilate((part.weight > 0).astype(np.uint8), np.ones((2 * step + 1, 2 * step + 1), np.uint8))
    height, width = part.weight.shape
    column, row = (
        np.clip(np.rint(at), 0, last - 1).astype(int)
        for at, last in zip(np.moveaxis(every_nth_pixel((width, height), step), -1, 0), (width, height), strict=True)
    )
    return np.asarray(reach, bool)[row, column]


def filled(motion: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return motion (h, w, 2) where it is NaN with means of its neighbours, up to three places away; beyond that 0."""
    known = np.asarray(np.isfinite(motion).all(axis=-1))
    for _ in range(3):
        if known.all():
            break
        weight = cv2.blur(known.astype(np.float32), (3, 3))
        around = cv2.blur(np.where(known[..., None], motion, np.float32(0)), (3, 3))
        reached = np.logical_not(known) & (weight > 0)
        motion[reached] = (around / np.maximum(weight, 1e-6)[..., None])[reached]
        known = known | reached
    return np.nan_to_num(motion)
