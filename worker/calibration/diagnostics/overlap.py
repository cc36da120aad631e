"""Overlap of the segmentation with the expected markings: the share of them it finds, and what it finds beside them."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.evidence import MARKING, TOLERANCE_PX
from worker.calibration.detection.exclusions import left_out, line_band
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines


@dataclass(frozen=True)
class Overlap:
    """Overlap of a frame's segmentation with the markings that the pose expects.

    `iou` 0..1, as lengths of line; its two sides: the share of the expected line that is `found`, and the share of the
    segmentation on the field that is `unexpected`, beside all of it.
    """

    iou: float
    found: float
    unexpected: float

    @property
    def unexplained(self) -> float:
        """Paint on the field beside every expected line, as line, by the length of those; inf where none is found."""
        if self.iou > 0:
            return self.found / self.iou - 1
        return float("inf") if self.unexpected > 0 else 0.0


def overlap_of(pitch: Field, camera: Camera, response: NDArray[np.float32]) -> Overlap:
    """Measure the overlap of the markings expected by the pose with those in the segmentation (H, W).

    A line is thinner than any honest tolerance, so a plain IoU of pixels would measure paint and blur. Here a piece of
    expected line is found when the segmentation has a marking within `TOLERANCE_PX` of it; segmentation on the field
    that lies beside every expected line counts as as much line as it could have been. A line thinner than a pixel
    covers only a part of it, and has that part of the weight and of the response that is asked for.
    """
    seen = VisibleLines.from_camera(pitch.line_points(), camera)
    coverage = np.minimum(seen.width_px, 1.0)
    weight = seen.length_px * coverage
    expected = float(weight.sum())
    if expected == 0:
        return Overlap(0.0, 0.0, 0.0)
    tolerance = max(TOLERANCE_PX * camera.intrinsics.relative_size, 1.0)
    found = float(weight[_strongest(response, tolerance)[_rounded(seen.pixel)] > MARKING * coverage].sum())
    marked = (response > MARKING).astype(np.uint8)
    explained = line_band(seen, camera.intrinsics.size, tolerance)
    area_explained = int(np.count_nonzero(marked & explained))
    beside_all = marked & _pitch_area(pitch, camera) & ~explained
    not_counted = left_out(pitch, camera)
    area_beside = int(np.count_nonzero(beside_all if not_counted is None else beside_all & ~not_counted))
    unexpected_px = area_beside * found / area_explained if area_explained else float(area_beside)
    unexpected = area_beside / (area_beside + area_explained) if area_beside else 0.0
    return Overlap(found / (expected + unexpected_px), found / expected, unexpected)


def _strongest(response: NDArray[np.float32], distance: float) -> NDArray[np.float32]:
    """Return the largest response (H, W) within `distance` of each pixel."""
    size = 2 * round(distance) + 1
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.dilate(response, around), dtype=np.float32)


def _rounded(pixels: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    x, y = np.rint(pixels).astype(np.intp).T
    return y, x


def _pitch_area(pitch: Field, camera: Camera) -> NDArray[np.uint8]:
    """Return 1 inside the field and a metre around it, at a sixteenth of the picture's detail."""
    coarse = camera.intrinsics.scaled(1 / 16)
    width, height = coarse.size
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    rays = Camera(camera.id, coarse, camera.pose).rays(np.stack([x, y], axis=-1))
    around_pitch_m = 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = -camera.pose.position[2] / rays[..., 2]
        ground = camera.pose.position[:2] + distance[..., None] * rays[..., :2]
        on_pitch = (
            (distance > 0)
            & (np.abs(ground[..., 0]) < pitch.length / 2 + around_pitch_m)
            & (np.abs(ground[..., 1]) < pitch.width / 2 + around_pitch_m)
        )
    full = cv2.resize(on_pitch.astype(np.uint8), camera.intrinsics.size, interpolation=cv2.INTER_NEAREST)
    return np.asarray(full, dtype=np.uint8)
