"""Pictures by which a person judges a lens and a first pose: the evidence, and how well it fits."""

import cv2
import numpy as np

from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.onboarding.clicks import Clicks
from worker.calibration.onboarding.first_pose_verdict import FirstPose
from worker.calibration.onboarding.lens_calibration import LensCalibration
from worker.calibration.rendering.overlays import centre_lines, draw_line, legend
from worker.calibration.rendering.palette import PICTURE_WIDTH_PX, Palette


def coverage_picture(found: LensCalibration) -> Frame:
    """Draw a camera's picture with every corner that was used, its residual enlarged, and the cells none reached."""
    width, height = found.lens.size
    scale = PICTURE_WIDTH_PX / width
    size = (PICTURE_WIDTH_PX, round(height * scale))
    # Below the picture there is room for the legend, which would hide corners.
    picture = np.full((size[1] + 180, size[0], 3), Palette.PAPER, np.uint8)
    rows, columns = found.coverage.cells.shape
    for row, column in np.ndindex(rows, columns):
        box = [round(column * size[0] / columns), round(row * size[1] / rows)]
        end = [round((column + 1) * size[0] / columns), round((row + 1) * size[1] / rows)]
        colour = Palette.COVERED if found.coverage.cells[row, column] else Palette.BARE
        cv2.rectangle(picture, box, end, colour, cv2.FILLED)
        cv2.rectangle(picture, box, end, (205, 205, 205), 1)
    lengths = np.linalg.norm(found.off, axis=1)
    # Length of the arrow for a residual of the median size.
    enlarged = 12.0 / max(float(np.median(lengths)) * scale, 1e-9)
    ends = found.corners + enlarged * found.off
    arrow = (40, 40, 220)
    for corner, end in zip((found.corners + 0.5) * scale - 0.5, (ends + 0.5) * scale - 0.5, strict=True):
        cv2.circle(picture, _fixed(corner), 3 * 16, Palette.CORNER, cv2.FILLED, cv2.LINE_AA, shift=4)
        cv2.line(picture, _fixed(corner), _fixed(end), arrow, 1, cv2.LINE_AA, shift=4)
    centre = (200, 0, 200)
    _cross(picture, (found.lens.matrix[:2, 2] + 0.5) * scale - 0.5, centre, 16)
    legend(
        picture,
        [
            ("corner of the board", Palette.CORNER),
            (f"residual x {enlarged:.0f}", arrow),
            (f"no corner here ({1 - found.coverage.share:.0%})", Palette.BARE),
            ("principal point", centre),
        ],
    )
    return picture


def clicks_picture(pitch: Field, clicks: Clicks, found: FirstPose, frame: Frame | None) -> Frame:
    """Draw the field by the first pose, over the frame if there is one, and each click with its label's place."""
    width, height = found.camera.intrinsics.size
    picture = np.full((height, width, 3), Palette.PAPER, np.uint8) if frame is None else frame.copy()
    thick = max(1, round(width / 1500))
    for line in centre_lines(pitch, found.camera):
        draw_line(picture, line, Palette.NEW, thick)
    expected = found.camera.project(clicks.world)
    clicked = (60, 200, 60)
    mislabelled = (40, 40, 240)
    for pixel, place, verdict in zip(clicks.pixel, expected, found.clicks, strict=True):
        colour = mislabelled if verdict.doubted else clicked
        cv2.circle(picture, _fixed(pixel), 8 * thick * 16, colour, 2 * thick, cv2.LINE_AA, shift=4)
        if np.isfinite(place).all():
            _cross(picture, place, Palette.EXPECTED, 6 * thick)
            cv2.line(picture, _fixed(pixel), _fixed(place), colour, thick, cv2.LINE_AA, shift=4)
    entries = [("pitch at the first pose", Palette.NEW), ("click", clicked), ("where its label is", Palette.EXPECTED)]
    legend(picture, [*entries, ("does not fit its label", mislabelled)])
    return picture


def _cross(picture: Frame, place: Array, colour: tuple[int, int, int], arm: int) -> None:
    for across in ([arm, 0.0], [0.0, arm]):
        cv2.line(picture, _fixed(place - across), _fixed(place + across), colour, 2, cv2.LINE_AA, shift=4)


def _fixed(place: Array) -> tuple[int, int]:
    """Return sub-pixel places as OpenCV's drawing takes them, with four bits behind the point, and clipped."""
    x, y = np.rint(np.clip(place, -1e5, 1e5) * 16).astype(int).tolist()
    return x, y
