"""Paint that a frame shows, and the share of it that a camera explains."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.exclusions import line_band
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.relocalisation.line_view import middles_of_paint

WIDTH_PX = 960


@dataclass(frozen=True)
class Paint:
    """Pixels (n, 2), column and row, on the middles of what is painted, of a frame that is `WIDTH_PX` wide."""

    middles: NDArray[np.intp]

    @classmethod
    def of(cls, response: NDArray[np.uint8]) -> "Paint":
        """Return the paint in a response (height, width), 0..255, of the network."""
        height, width = response.shape
        size = (WIDTH_PX, round(height * WIDTH_PX / width))
        small = np.asarray(cv2.resize(response, size, interpolation=cv2.INTER_AREA), np.uint8)
        return cls(middles_of_paint(small).astype(np.intp))

    def explained_by(self, field: Field, camera: Camera) -> float:
        """Return the share of the paint, 0..1, on the markings as a camera puts them, on the roof of the field."""
        return share(self.on_markings(field, camera))

    def on_markings(self, field: Field, camera: Camera) -> NDArray[np.bool_]:
        """True for places (n,) on a marking as a camera puts it, on the roof of the field."""
        small = camera.with_lens(camera.intrinsics.scaled(WIDTH_PX / camera.intrinsics.size[0]))
        # Distance from an expected line within which it explains paint, in pixels of the shrunk frame.
        band = line_band(VisibleLines.from_camera(field.line_points(), small), small.intrinsics.size, 3.0)
        column, row = self.middles.T
        inside = row < band.shape[0]
        return inside & (band[np.minimum(row, band.shape[0] - 1), column] > 0)


def share(chosen: NDArray[np.bool_]) -> float:
    """Return the share 0..1 of the places (n,) that are chosen, 0 where there are none."""
    return float(chosen.mean()) if len(chosen) else 0.0
