"""One still view out of several frames of a camera: what walks by vanishes, and the camera's shaking is undone.

A mast sways by a pixel or more from frame to frame. The median of such frames would erase every line thinner than
that, so each frame is read where the camera had turned to when it was taken. A small sway turns a camera far more than
it moves it: three numbers a frame, found from what stands still around the pitch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Frame, Pose
from worker.calibration.geometry.derivatives import pixel_jacobian
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_matrices

Grey = NDArray[np.uint8]

FEWEST_FOLLOWED = 30
"""Fewest corners to be found again in a frame; with fewer it is taken for still."""
GRID_PX = 32


@dataclass(frozen=True)
class Sway:
    """Displacement of a frame against the still view: `shift` (h, w, 2) px at every `GRID_PX`-th pixel, or None."""

    shift: NDArray[np.float32] | None

    @classmethod
    def from_turn(cls, turn: Array, lens: Lens) -> "Sway":
        """Return the displacement for a camera that turned by a rotation vector (3,) in its own frame, rad."""
        width, height = lens.size
        grid = np.stack(
            np.meshgrid(np.arange(0, width + GRID_PX, GRID_PX), np.arange(0, height + GRID_PX, GRID_PX)), -1
        )
        camera = _at_origin(lens)
        shift = camera.project(camera.rays(grid.astype(float)) @ rotation_matrices(turn).T) - grid
        shift = np.nan_to_num(shift, nan=0.0, posinf=0.0, neginf=0.0)
        # Shift below which a frame is left as it is.
        return cls(shift.astype(np.float32) if np.abs(shift).max() > 0.05 else None)

    def rows(self, picture: NDArray[np.uint8], top: int, bottom: int) -> NDArray[np.uint8]:
        """Return rows of the still view (bottom - top, W), resampled from the frame's `picture` (H, W)."""
        if self.shift is None:
            return picture[top:bottom]
        columns = np.arange(picture.shape[1], dtype=np.float32)
        x, y = np.meshgrid(columns, np.arange(top, bottom, dtype=np.float32))
        shift = cv2.remap(self.shift, x / GRID_PX, y / GRID_PX, cv2.INTER_LINEAR)
        read = cv2.remap(
            picture, x + shift[..., 0], y + shift[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(read, dtype=np.uint8)


def sways(frames: Sequence[Frame], lens: Lens) -> list[Sway]:
    """Return the displacement of each of several frames against the camera's mean position. Deterministic."""
    if len(frames) == 1:
        return [Sway(None)]
    first = _grey(frames[0])
    corners = cv2.goodFeaturesToTrack(first, 800, 0.005, 12)
    turns = np.zeros((len(frames), 3))
    if corners is not None:
        there = np.asarray(corners, dtype=np.float32)
        turns[1:] = [_turn(first, _grey(frame), there, lens) for frame in frames[1:]]
    return [Sway.from_turn(turn, lens) for turn in turns - turns.mean(axis=0)]


def median(pictures: Sequence[NDArray[np.uint8]], swayed: Sequence[Sway]) -> NDArray[np.float32]:
    """Return the median (H, W) of pictures of one camera in its still view; computed in bands, to bound the memory."""
    if len(pictures) == 1:
        return pictures[0].astype(np.float32)
    planes = [np.ascontiguousarray(picture) for picture in pictures]
    still = np.empty(planes[0].shape, dtype=np.float32)
    band_rows = 128
    for top in range(0, len(still), band_rows):
        bottom = min(top + band_rows, len(still))
        still[top:bottom] = np.median(
            [sway.rows(plane, top, bottom) for plane, sway in zip(planes, swayed, strict=True)], axis=0
        )
    return still


def _grey(frame: Frame) -> Grey:
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _turn(first: Grey, later: Grey, corners: NDArray[np.floating], lens: Lens) -> Array:
    """Return the rotation vector (3,) rad of the camera between two frames; zeros where too few corners tell."""
    before, after = _standing_still(first, later, corners)
    if len(before) < FEWEST_FOLLOWED:
        return np.zeros(3)
    camera = _at_origin(lens)
    jacobian = pixel_jacobian(camera, camera.rays(before))[..., :3]
    counted = np.isfinite(jacobian).all(axis=(1, 2))
    for _ in range(2):
        turn = np.linalg.lstsq(jacobian[counted].reshape(-1, 3), (after - before)[counted].ravel(), rcond=None)[0]
        off = np.linalg.norm(after - before - jacobian @ turn, axis=1)
        counted &= off <= 3.0 * np.sqrt(np.mean(off[counted] ** 2))
    return np.asarray(turn, dtype=float)


def _standing_still(first: Grey, later: Grey, corners: NDArray[np.floating]) -> tuple[Array, Array]:
    """Return pixels (N, 2) of corners that stand still in two frames: what walks moves unlike the rest."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(first, later, corners, np.empty_like(corners))
    back, found_again, _ = cv2.calcOpticalFlowPyrLK(later, first, there, np.empty_like(corners))
    followed = (np.asarray(found, dtype=bool) & np.asarray(found_again, dtype=bool)).ravel()
    # Largest distance between a corner and where it is found when it is followed to the other frame and back again.
    followed &= np.linalg.norm(back - corners, axis=-1).ravel() < 0.3
    before, after = corners[followed].reshape(-1, 2), there[followed].reshape(-1, 2)
    if len(before) >= FEWEST_FOLLOWED:
        # Largest distance of a corner from a common motion for it to stand still.
        _, still = cv2.estimateAffinePartial2D(before, after, ransacReprojThreshold=1.0)
        together = np.zeros(len(before), dtype=bool) if still is None else still.ravel() > 0
        before, after = before[together], after[together]
    return before.astype(float), after.astype(float)


def _at_origin(lens: Lens) -> Camera:
    """Return a camera that looks along its own axes: its rays are directions in its own frame."""
    return Camera("still", lens, Pose(np.zeros(3), np.zeros(3)))
