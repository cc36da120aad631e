"""The part of the ground that the nets look at, from above: in front of the camera, as large as the camera is high.

A bird's-eye view of the whole pitch would not do. A camera that is tilted by an angle moves what it sees at the
distance d by the angle times (d² / h + h), h its height: for 2.1° and 11 m that is 1 m at 15 m, 5 m at 38 m and 30 m at
the far corner, where a line is half a pixel high. So the window begins where a picture usually does, 1.1 heights ahead,
and ends at 4.9 heights, where two degrees are 9 m of 42; and the four points whose displacement is learnt lie well
inside, at 1.8 and 3.8 heights. Measured in heights the same turn displaces the same pixels by as much, whatever the
height: a net learns one thing and not one per stand.

Pixels are (column, row) with their centres at integers; the lowest row is the nearest.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.sampling import bilinear
from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field

SIZE = (160, 128)
HEIGHTS_PER_PIXEL = 0.03
NEAREST_HEIGHTS = 1.1
QUAD = np.array([[37.0, 37.0], [122.0, 37.0], [111.0, 104.0], [48.0, 104.0]])
"""The four points: 3.8 camera heights ahead and 1.8, where the usual picture sees the ground well."""
FINER = 4
"""How much finer a mask is drawn or read than it is shown, each way: a line is narrower than a pixel."""
BLUR_PX = 0.7
LINE_M = 0.25
"""How wide a line of the template is: about what the network makes of it half way to the far end."""

Picture = NDArray[np.float32]
"""A mask (height, width) of the window, 0..1."""


@dataclass(frozen=True)
class Window:
    """Place of the window: below the camera `foot` (2,), unit vectors `right` and `ahead` (2,), metres a pixel."""

    foot: Array
    right: Array
    ahead: Array
    pixel_m: float

    @classmethod
    def of(cls, pose: Pose) -> Window:
        """The window of a camera that stands so; it has to look down at least a little."""
        ahead = pose.matrix[2, :2] / np.linalg.norm(pose.matrix[2, :2])
        right = np.array([ahead[1], -ahead[0]])
        return cls(pose.position[:2], right, ahead, HEIGHTS_PER_PIXEL * float(pose.position[2]))

    def ground(self, pixels: Array) -> Array:
        """Map pixels (..., 2) of the window to the ground (..., 2)."""
        across = (pixels[..., :1] - (SIZE[0] - 1) / 2) * self.pixel_m
        along = (SIZE[1] - 1 - pixels[..., 1:] + NEAREST_HEIGHTS / HEIGHTS_PER_PIXEL) * self.pixel_m
        return self.foot + across * self.right + along * self.ahead

    def pixels(self, ground: Array) -> Array:
        """Map ground points (..., 2) to pixels of the window (..., 2)."""
        across = (ground - self.foot) @ self.right / self.pixel_m
        along = (ground - self.foot) @ self.ahead / self.pixel_m
        rows = SIZE[1] - 1 + NEAREST_HEIGHTS / HEIGHTS_PER_PIXEL - along
        return np.stack([across + (SIZE[0] - 1) / 2, rows], axis=-1)

    def template(self, pitch: Field) -> Picture:
        """The markings where they are."""
        points = pitch.line_points(1.0)
        at = self.pixels(points.position[:, :2])
        joined = points.marking[:-1] == points.marking[1:]
        width = np.full(len(at), LINE_M / self.pixel_m)
        return shown(strokes(at, joined, width))

    def seen(self, response: NDArray[np.float32], camera: Camera, pitch: Field) -> Picture:
        """A segmentation (H, W) in 0..1 of the camera's frame, laid onto the ground by the camera's pose."""
        columns, rows = np.meshgrid(*(_finer_centres(length) for length in SIZE))
        ground = self.ground(np.stack([columns, rows], axis=-1))
        return shown(bilinear(response, camera.project(pitch.lift(ground))))


def _finer_centres(length: int) -> Array:
    """The pixels of the finer picture, in pixels of the window."""
    return (np.arange(FINER * length) + 0.5) / FINER - 0.5


def strokes(at: Array, joined: NDArray[np.bool_], width: Array) -> NDArray[np.float32]:
    """Lines between successive points (N, 2) of the window where `joined` (N - 1,), `FINER` times finer than it.

    `width` (N,): of the line at each point, in pixels of the window.
    """
    canvas = np.zeros((FINER * SIZE[1], FINER * SIZE[0]), dtype=np.uint8)
    near = np.all(np.abs(at - np.array(SIZE) / 2) < SIZE, axis=1)
    kept = joined & near[:-1] & near[1:]
    fine = FINER * (at + 0.5) - 0.5
    pieces = np.rint(16 * np.stack([fine[:-1], fine[1:]], axis=1)[kept]).astype(np.int32)
    thickness = np.clip(np.rint(FINER * width[:-1][kept]), 1, 4 * FINER).astype(int)
    for each in np.unique(thickness):
        cv2.polylines(canvas, list(pieces[thickness == each]), False, 255, int(each), cv2.LINE_AA, shift=4)
    return canvas.astype(np.float32) / 255


def shown(finer: NDArray[np.float32]) -> Picture:
    """A finer picture as the nets see it: averaged, and blurred a little, so that a shift of half a pixel shows."""
    small = cv2.resize(finer, SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), BLUR_PX), dtype=np.float32)


def placed(points: Array, by: Pose, seen_from: Pose, pitch: Field) -> Array:
    """Return where on the roof (N, 2) the pose `by` puts what another pose sees of points (N, 3), by one lens.

    NaN for what is behind either, or put above the horizon.
    """
    in_camera = (points - seen_from.position) @ seen_from.matrix.T
    rays = in_camera @ by.matrix
    with np.errstate(divide="ignore", invalid="ignore"):
        per_metre = np.where((in_camera[:, 2] > 0) & (rays[:, 2] < 0), -1 / rays[:, 2], np.nan)
    height = np.zeros(len(points))
    for _ in range(4):
        ground = by.position[:2] + rays[:, :2] * (per_metre * (by.position[2] - height))[:, None]
        height = pitch.height(ground)
    return ground
