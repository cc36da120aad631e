"""Panorama: the place of each pixel of a stitched view in the frames, the weight of each camera there, and its picture.

A panorama is geometry: it holds until a pose, a lens, the view or the light of a camera changes, and any number of
frames go through it (`Panorama.picture`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import box, quality, sampled
from worker.calibration.stitching.photometry import NEUTRAL, Light
from worker.calibration.stitching.views import StitchedView

# Colour of what no camera sees: dark grey rather than black, so that it reads as "outside" and not as "broken".
BACKDROP = 38
# Geometry is computed at every n-th pixel and interpolated; the tests hold it below 0.05 px.
GEOMETRY_STEP = 4


@dataclass(frozen=True)
class Contribution:
    """Contribution of one camera to a view of (H, W) pixels.

    `weight` (H, W): how much it counts, 0 to 1; `source` (H, W, 2): the pixel x, y of its frame (centres at integers),
    anything where it does not count.
    """

    camera: str
    frame_size: tuple[int, int]
    source: NDArray[np.float32]
    weight: NDArray[np.float32]
    light: Light

    @property
    def rise(self) -> NDArray[np.float32]:
        """Factor (H, W) on its pixels for what its lens takes from the corners."""
        return self.light.rise(self.source, self.frame_size)

    def values(self, frame: Frame, around: tuple[slice, slice]) -> NDArray[np.float32]:
        """Return the camera's colours (h, w, 3) in rows and columns of the view, evened out with the other cameras'."""
        source = self.source[around]
        raw = sampled(frame, source, self.weight[around] > 0)
        toned = cv2.LUT(raw, self.light.tones[:, None, :])
        return np.asarray(toned, np.float32) * self.light.rise(source, self.frame_size)[..., None]


@dataclass(frozen=True)
class Panorama:
    """Stitched view of `size` (width, height): its parts, whose weights sum to 1 where any camera sees."""

    size: tuple[int, int]
    parts: Sequence[Contribution]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Mask (H, W) of pixels that any camera sees."""
        return np.any([part.weight > 0 for part in self.parts], axis=0)

    @property
    def owner(self) -> NDArray[np.int8]:
        """Number of the camera that counts most, (H, W); -1 where none sees."""
        best = np.argmax([part.weight for part in self.parts], axis=0)
        return np.where(self.seen, best, -1).astype(np.int8)

    def picture(self, frames: Mapping[str, Frame]) -> Frame:
        """Return the view (H, W, 3), BGR, of one frame of each camera, of the size of its camera's frames."""
        width, height = self.size
        total = np.full((height, width, 3), BACKDROP, np.float32)
        total[self.seen] = 0
        for part in self.parts:
            counts = part.weight > 0
            if not counts.any():
                continue
            # Most of a wide view is of one camera alone.
            around = box(counts)
            total[around] += part.weight[around][..., None] * part.values(frames[part.camera], around)
        return np.clip(np.rint(total), 0, 255).astype(np.uint8)


def panorama(
    pitch: Field, view: StitchedView, cameras: Sequence[Camera], lights: Mapping[str, Light] | None = None
) -> Panorama:
    """Return the panorama of the cameras. `lights` by camera; a camera that has none is taken as it is."""
    lights = lights or {}
    points = view.behind(pitch, every_nth_pixel(view.size))
    pixels = [camera.project(points) for camera in cameras]
    qualities = np.stack(
        [
            every_pixel(quality(camera.intrinsics.size, at) * np.exp(lights.get(camera.id, NEUTRAL).reach), view.size)
            for camera, at in zip(cameras, pixels, strict=True)
        ]
    )
    sources = [every_pixel(at, view.size) for at in pixels]
    valid = np.stack([inside(at, camera.intrinsics.size) for camera, at in zip(cameras, sources, strict=True)])
    weights = seam_weights(np.where(valid, np.maximum(qualities, 1e-9), np.float32(0)))
    parts = [
        Contribution(
            camera.id,
            camera.intrinsics.size,
            # Finite wherever somebody looks at it, and not so far off that arithmetic overflows.
            np.nan_to_num(np.clip(at, *np.outer([-1, 2], camera.intrinsics.size))).astype(np.float32),
            weight,
            lights.get(camera.id, NEUTRAL),
        )
        for camera, at, weight in zip(cameras, sources, weights, strict=True)
    ]
    return Panorama(view.size, parts)


def seam_weights(qualities: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return weights (cameras, H, W) that sum to 1 where any camera sees: the best one's, feathered."""
    # Power of how well a camera sees: a short feather, so that players who stand off the ground do not become ghosts.
    relative = (qualities / np.maximum(qualities.max(axis=0), 1e-30)) ** 60
    relative /= np.maximum(relative.sum(axis=0), 1e-30)
    # Below this a camera does not count: less than half a grey level of a white pixel.
    relative[relative < (1 / 512)] = 0
    weights: NDArray[np.float32] = relative / np.maximum(relative.sum(axis=0), 1e-30)
    return weights


def every_nth_pixel(size: tuple[int, int], step: int = GEOMETRY_STEP) -> Array:
    """Return positions (h, w, 2) of the centres of blocks of `step` pixels, one block more on each side."""
    x, y = (step * (np.arange(-1, -(-extent // step) + 1) + 0.5) - 0.5 for extent in size)
    return np.stack(np.meshgrid(x, y), axis=-1)


def every_pixel(values: NDArray[Any], size: tuple[int, int], step: int = GEOMETRY_STEP) -> NDArray[np.float32]:
    """Interpolate values (h, w[, 2]) at `every_nth_pixel` linearly to every pixel (height, width[, 2])."""
    width, height = size
    fine = cv2.resize(values.astype(np.float32), None, fx=step, fy=step, interpolation=cv2.INTER_LINEAR)
    dense = np.asarray(fine, np.float32)
    return dense[step : step + height, step : step + width]
