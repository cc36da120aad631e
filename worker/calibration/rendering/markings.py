"""Markings in words and colours on the frame, so that a person finds the line that is meant."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from worker.calibration.diagnostics.markings import MarkingReport, in_words
from worker.calibration.geometry.camera import Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.rendering.palette import Palette

WELL_FOUND = 0.7
WRONG = ((f"found less than {WELL_FOUND:.0%}", Palette.MISSING), ("painted elsewhere", Palette.ELSEWHERE))


def colour_of(seen: MarkingReport) -> tuple[int, int, int]:
    """Return blue where all is well, magenta where the paint is elsewhere, cyan where it is hardly found."""
    if seen.is_elsewhere:
        return Palette.ELSEWHERE
    return Palette.NEW if seen.found >= WELL_FOUND else Palette.MISSING


def colours_of(pitch: Field, seen: Sequence[MarkingReport]) -> list[tuple[int, int, int]]:
    """Return the colour of each marking of the field; blue where nothing is said of it."""
    said = {one.name: colour_of(one) for one in seen}
    return [said.get(name, Palette.NEW) for name in pitch.whole_names()]


def list_wrong(picture: Frame, pitch: Field, camera: Camera, seen: Sequence[MarkingReport]) -> None:
    """Number the markings that are elsewhere or hardly found, the worst first, and list what is wrong in a corner."""
    wrong = worst(seen)[:12]
    if not wrong:
        return
    # Height of the letters, in widths of the picture.
    text_px = max(10.0, 0.009 * picture.shape[1])
    scale, thick, pad = text_px / 22, max(1, round(text_px / 16)), round(text_px)
    lines = [f"{number}  {in_words(one)}" for number, one in enumerate(wrong, 1)]
    widest = max(cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, scale, thick)[0][0] for line in lines)
    box = picture[pad : pad * (2 + 2 * len(lines)), pad : 3 * pad + widest]
    box[:] = box // 4
    middles = _middles(pitch, camera)
    for row, (line, one) in enumerate(zip(lines, wrong, strict=True)):
        colour = colour_of(one)
        _write(picture, line, (2 * pad, pad * (3 + 2 * row)), scale, colour, thick)
        if one.name in middles:
            _badge(picture, str(row + 1), middles[one.name], pad, scale, colour, thick)


def _badge(
    picture: Frame,
    number: str,
    middle: tuple[float, float],
    pad: int,
    scale: float,
    colour: tuple[int, int, int],
    thick: int,
) -> None:
    """Draw a number beside a marking, joined to it."""
    x, y = round(middle[0]), round(middle[1])
    up = -3 * pad if y > 5 * pad else 3 * pad
    cv2.line(picture, (x, y), (x, y + up), colour, thick, cv2.LINE_AA)
    cv2.circle(picture, (x, y + up), round(1.2 * pad), (0, 0, 0), cv2.FILLED, cv2.LINE_AA)
    cv2.circle(picture, (x, y + up), round(1.2 * pad), colour, thick, cv2.LINE_AA)
    (wide, high), _ = cv2.getTextSize(number, cv2.FONT_HERSHEY_SIMPLEX, scale, thick)
    _write(picture, number, (x - wide // 2, y + up + high // 2), scale, colour, thick)


def _write(
    picture: Frame, words: str, place: tuple[int, int], scale: float, colour: tuple[int, int, int], thick: int
) -> None:
    cv2.putText(picture, words, place, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, thick, cv2.LINE_AA)


def worst(seen: Sequence[MarkingReport]) -> list[MarkingReport]:
    """Return the markings with something wrong: those elsewhere by their offset, then others by what is missing."""
    wrong = [one for one in seen if colour_of(one) != Palette.NEW]
    return sorted(wrong, key=lambda one: (not one.is_elsewhere, -abs(one.offset_m or 0.0) - one.expected_m))


def _middles(pitch: Field, camera: Camera) -> Mapping[str, tuple[float, float]]:
    """Return the pixel in the middle of what is in view of each marking, by name."""
    lines, names = pitch.line_points(), pitch.whole_names()
    pixel = camera.project(lines.position)
    seen = inside(pixel, camera.intrinsics.size)
    middles = {}
    for name in dict.fromkeys(names):
        its = np.flatnonzero(seen & np.isin(lines.marking, [n for n, other in enumerate(names) if other == name]))
        if len(its):
            x, y = pixel[its[len(its) // 2]]
            middles[name] = float(x), float(y)
    return middles
