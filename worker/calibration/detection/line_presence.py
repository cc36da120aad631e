"""Test whether the markings are visible at all, near where a pose that may be some degrees off expects them.

    sight = look_for_lines(picture, seen_lines, reach_px)

No network and no search for a pose: thin bright or dark streaks along the expected directions, in a picture of some
thousand columns. The lines of one camera move together when it turns, so the one shift that most of them agree on is
found first; only near it is each of them looked for.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.streaks import LEAST_CONTRAST, Streaks
from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.geometry.visibility import VisibleLines

AGREED_PX = 2.5
"""Largest difference between the offsets of two neighbours on one line."""


@dataclass(frozen=True)
class LinesInSight:
    """Search result at N expected places on lines.

    `pixel` (N, 2): their place after the shift; `found` (N,): True if there is a line; `contrast` (N,): of the
    strongest streak there, in grey levels.
    """

    pixel: Array
    found: NDArray[np.bool_]
    contrast: Array


def look_for_lines(picture: Frame, lines: VisibleLines, reach_px: float) -> LinesInSight:
    """Look for `lines` in a picture (H, W, 3) that may be shifted by `reach_px` each way."""
    if len(lines) == 0:
        return LinesInSight(np.empty((0, 2)), np.empty(0, dtype=bool), np.empty(0))
    streaks = Streaks.of(picture)
    at: Array = lines.pixel + _common_shift(streaks, lines, reach_px)
    for _ in range(2):
        offset, contrast, found = _match(streaks, lines, at)
        # More contrast counts no more.
        at = at + _movement(at, lines.normal, offset, np.where(found, np.minimum(contrast, 20.0), 0.0))
    _, contrast, found = _match(streaks, lines, at)
    return LinesInSight(at, found, contrast)


def _match(streaks: Streaks, lines: VisibleLines, at: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Find the strongest streak along the normal of each line, near `at` (N, 2): offset, contrast, True for a line."""
    # Largest distance of a line from the common shift: a turn bends what it shifts, and the place may be off as well.
    near_px = 12
    steps = np.arange(-near_px, near_px + 1)
    near, *beside = (
        streaks.read(lines, at[:, None] + (steps + aside)[:, None] * lines.normal[:, None])
        for aside in (0, -2 * near_px - 1, 2 * near_px + 1)
    )
    best = near.argmax(axis=1)
    contrast = near[np.arange(len(near)), best]
    chance = np.mean([strength.max(axis=1) for strength in beside], axis=0)
    # A line stands out by so much from chance beside it in all of the picture, and in its square of it: nets, patterns
    # and lettering are streaks as well.
    usual = np.maximum(LEAST_CONTRAST, 1.6 * np.median(chance))
    found = (contrast >= np.maximum(usual, 1.3 * _of_neighbours(at, chance))) & _agreeing(steps[best], lines)
    return steps[best].astype(float), contrast, found


def _of_neighbours(at: Array, values: Array) -> Array:
    """Return the median (N,) of values (N,) in the same square of the picture."""
    square = np.unique(np.floor(at / 120).astype(int), axis=0, return_inverse=True)[1].ravel()
    return np.array([np.median(values[square == number]) for number in range(square.max() + 1)])[square]


def _movement(at: Array, normal: Array, offset: Array, weight: Array) -> Array:
    """Fit the shift, turn and growth of the whole that brings the lines to where they were found: a movement (N, 2)."""
    middle = at - at.mean(axis=0)
    size = max(float(np.abs(middle).max()), 1.0)
    turn = np.stack([-middle[:, 1], middle[:, 0]], axis=1) / size
    moves = np.stack(
        [np.broadcast_to([1.0, 0.0], at.shape), np.broadcast_to([0.0, 1.0], at.shape), turn, middle / size]
    )
    across = np.einsum("kni,ni->nk", moves, normal)
    for _ in range(4):
        # Prior weight of no movement, so that a handful of lines does not turn the picture.
        system = (across * weight[:, None]).T @ across + 20.0 * np.diag([1.0, 1.0, 1.0, 3.0])
        by = np.linalg.solve(system, across.T @ (weight * offset))
        weight = weight / (1 + ((offset - across @ by) / AGREED_PX) ** 2)
    return np.einsum("kni,k->ni", moves, by)


def _agreeing(offset: NDArray[np.intp], lines: VisibleLines) -> NDArray[np.bool_]:
    """True (N,) if a neighbour on the same marking has about the same offset."""
    same = np.diff(lines.points.marking) == 0
    agree = same & (np.abs(np.diff(offset)) <= AGREED_PX)
    return np.concatenate([[False], agree]) | np.concatenate([agree, [False]])


def _common_shift(streaks: Streaks, lines: VisibleLines, reach_px: float) -> Array:
    """Return the shift (N, 2) at which most lines lie on streaks: the same for all but for a turn about the middle."""
    # Step between the shifts that are tried; streaks are widened by as much.
    coarse_px = 6
    steps = coarse_px * np.arange(-int(reach_px // coarse_px), int(reach_px // coarse_px) + 1)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    wide = streaks.widened(coarse_px)
    # Most places on lines that are used to find the shift.
    few = lines[np.linspace(0, len(lines) - 1, min(120, len(lines))).astype(np.intp)]
    # Of two shifts that are as good, the nearer one is taken.
    far = 0.05 * np.hypot(*shifts.T) / max(reach_px, 1.0)
    scores = []
    # Turns about the middle that are tried with each shift.
    rolls_rad = (-0.03, 0.0, 0.03)
    for roll in rolls_rad:
        evidence = wide.read(few, (few.pixel + _turned(few.pixel, lines.pixel, roll))[:, None] + shifts)
        # A streak of this contrast is half a line.
        scores.append((evidence / (evidence + 10.0)).mean(axis=0) - far)
    roll, best = divmod(int(np.argmax(scores)), len(shifts))
    return shifts[best] + _turned(lines.pixel, lines.pixel, rolls_rad[roll])


def _turned(pixel: Array, of: Array, angle: float) -> Array:
    """Return the displacement (N, 2) of pixels by a small turn of the picture about the middle of others."""
    away = pixel - of.mean(axis=0)
    return angle * np.stack([-away[:, 1], away[:, 0]], axis=1)
