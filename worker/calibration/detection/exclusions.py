"""Exclusions from a frame: ignored areas, and painted lines that are not the venue's."""

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ignored_areas import Ignored
from worker.calibration.geometry.visibility import VisibleLines


def left_out(pitch: Field, camera: Camera) -> NDArray[np.bool_] | None:
    """Return the mask (H, W) of pixels of a camera's frame that do not count, by its pose; None if all count.

    Where a line of the venue and another one meet, or are the same, the frame counts.
    """
    ignored = None if camera.ignored is None else camera.ignored.area
    others = pitch.other_points()
    if others is None:
        return ignored
    # Half width of the excluded band around other lines, in pixels of a 4K frame; 2 px at least.
    tolerance = max(6.0 * camera.intrinsics.relative_size, 2.0)
    other, own = (
        line_band(VisibleLines.from_camera(lines, camera), camera.intrinsics.size, tolerance) > 0
        for lines in (others, pitch.line_points())
    )
    band = other & ~own
    return band if ignored is None else band | ignored


def of_use(ignored: Ignored | None, response: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a response (H, W) to the frame of a camera with 0 where the frame is ignored."""
    return response if ignored is None else np.where(ignored.area, np.float32(0), response)


def line_band(seen: VisibleLines, size: tuple[int, int], tolerance: float) -> NDArray[np.uint8]:
    """Return 1 for pixels (H, W) on a line or within `tolerance` of one, 0 elsewhere."""
    band = np.zeros((size[1], size[0]), dtype=np.uint8)
    along = np.stack([seen.normal[:, 1], -seen.normal[:, 0]], axis=1) * seen.length_px[:, None] * 0.6
    thickness = np.rint(seen.width_px + 2 * tolerance).astype(int)
    starts, ends = (np.rint(16 * (seen.pixel + sign * along)).astype(int) for sign in (-1, 1))
    for start, end, thick in zip(starts.tolist(), ends.tolist(), thickness.tolist(), strict=True):
        cv2.line(band, start, end, 1, min(max(thick, 1), 255), shift=4)
    return band
