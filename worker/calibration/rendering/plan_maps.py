"""Maps of a plan: the field from above, coloured by what the cameras would make of each place."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.rendering.overlays import draw_line, outline
from worker.calibration.rendering.palette import BGR, PICTURE_WIDTH_PX, Palette

MARGIN_PX, TEXT_PX = 60, 26


@dataclass(frozen=True)
class Scale:
    """Colours of a map: values below the first of `limits` have the first of `colours`, and so on; `names` of them."""

    title: str
    limits: Sequence[float]
    colours: Sequence[BGR]
    names: Sequence[str]


PLACE = Scale(
    "Expected sigma of a player's place on the ground",
    (0.03, 0.06, 0.10, 0.15, 0.25),
    Palette.STEPS,
    ("below 3 cm", "3 to 6 cm", "6 to 10 cm", "10 to 15 cm", "15 to 25 cm", "above 25 cm"),
)
RESOLUTION = Scale(
    "Pixels per metre, across the line of sight",
    (10.0, 20.0, 40.0, 80.0, 160.0),
    Palette.STEPS[::-1],
    ("below 10", "10 to 20", "20 to 40", "40 to 80", "80 to 160", "above 160"),
)
COVERAGE = Scale(
    "Number of cameras that see a place",
    (1.5, 2.5, 3.5),
    ((233, 217, 171), (180, 117, 69), (120, 60, 30), (70, 30, 10)),
    ("one camera", "two", "three", "four or more"),
)


def plan_map(pitch: Field, values: Array, cameras: Sequence[Camera], scale: Scale) -> Frame:
    """Draw values (H, W) on the field from above, NaN for places that no camera sees, with its lines and the cameras.

    Rows begin at the far touchline.
    """
    sheet, row_px = _Sheet(pitch, cameras), TEXT_PX * 4 // 3
    picture = np.full((sheet.height_px + (len(scale.names) + 3) * row_px, PICTURE_WIDTH_PX, 3), 255, np.uint8)
    corners = [np.array([side * pitch.length / 2, -side * pitch.width / 2]) for side in (-1, 1)]
    (left, top), (right, bottom) = (np.rint(sheet.pixel(corner)).astype(int).tolist() for corner in corners)
    picture[top:bottom, left:right] = _coloured(values, scale, (right - left, bottom - top))
    for marking in pitch.markings():
        draw_line(picture, sheet.pixel(outline(marking)[0]), Palette.INK, 2)
    for camera in cameras:
        _draw_camera(picture, sheet, camera)
    _write(picture, scale.title, (MARGIN_PX, TEXT_PX * 2), 1.2)
    entries = [*zip(scale.names, scale.colours, strict=True), ("not seen", Palette.UNSEEN)]
    for row, (name, colour) in enumerate(entries):
        y = sheet.height_px + row * row_px
        cv2.rectangle(picture, (MARGIN_PX, y), (MARGIN_PX + 2 * TEXT_PX, y + TEXT_PX), colour, cv2.FILLED)
        cv2.rectangle(picture, (MARGIN_PX, y), (MARGIN_PX + 2 * TEXT_PX, y + TEXT_PX), Palette.INK, 1)
        _write(picture, name, (MARGIN_PX + 3 * TEXT_PX, y + TEXT_PX - 5), 0.85)
    return picture


def _coloured(values: Array, scale: Scale, size: tuple[int, int]) -> Frame:
    """Return a picture of `size` (width, height) of values (H, W), interpolated where they are finite."""
    known = np.isfinite(values)
    weight = cv2.resize(known.astype(float), size, interpolation=cv2.INTER_LINEAR)
    total = cv2.resize(np.where(known, values, 0.0), size, interpolation=cv2.INTER_LINEAR)
    step = np.searchsorted(np.array(scale.limits), total / np.maximum(weight, 1e-9))
    colours = np.array([*scale.colours, Palette.UNSEEN], np.uint8)
    return np.asarray(colours[np.where(weight > 0.5, step, len(scale.colours))], dtype=np.uint8)


class _Sheet:
    """Projection of the ground from above to the picture, with room for the cameras around the field."""

    def __init__(self, pitch: Field, cameras: Sequence[Camera]) -> None:
        half = np.array([pitch.length, pitch.width]) / 2
        # A camera that stands farther from the field, m, is drawn at this distance.
        self._reach = half + 60.0
        stands = np.clip([camera.pose.position[:2] for camera in cameras], -self._reach, self._reach)
        corners = np.concatenate([[-half, half], stands])
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        wide, high = self._high - self._low
        # A field that is filmed from afar is no taller than it is wide.
        self._scale = min((PICTURE_WIDTH_PX - 2 * MARGIN_PX) / wide, (PICTURE_WIDTH_PX - 2 * MARGIN_PX) / high)
        self.height_px = round(high * self._scale) + 3 * MARGIN_PX
        self._left = (PICTURE_WIDTH_PX - wide * self._scale) / 2

    def pixel(self, xy: Array) -> Array:
        """Return the pixels (..., 2) of places (..., 2) of the ground."""
        x, y = np.moveaxis(np.clip(xy, -self._reach, self._reach), -1, 0)
        return np.stack(
            [self._left + (x - self._low[0]) * self._scale, 1.5 * MARGIN_PX + (self._high[1] - y) * self._scale],
            axis=-1,
        )


def _draw_camera(picture: Frame, sheet: _Sheet, camera: Camera) -> None:
    place = camera.pose.position[:2]
    ahead = camera.pose.matrix[2, :2]
    aim = place + 6.0 * ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    at, tip = (tuple(np.rint(sheet.pixel(point)).astype(int).tolist()) for point in (place, aim))
    cv2.arrowedLine(picture, at, tip, Palette.INK, 3, cv2.LINE_AA, tipLength=0.3)
    cv2.circle(picture, at, 9, Palette.INK, cv2.FILLED, cv2.LINE_AA)
    # At the arrow's tip: cameras on one mast look different ways.
    (wide, high), _ = cv2.getTextSize(camera.id, cv2.FONT_HERSHEY_SIMPLEX, 0.85, 2)
    away = np.array(tip) - at
    x, y = tip + away / max(float(np.linalg.norm(away)), 1e-9) * [(wide + TEXT_PX) / 2, (high + TEXT_PX) / 2]
    _write(picture, camera.id, (round(x - wide / 2), round(y + high / 2)), 0.85)


def _write(picture: Frame, words: str, place: tuple[int, int], size: float) -> None:
    cv2.putText(picture, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, Palette.INK, 2, cv2.LINE_AA)
