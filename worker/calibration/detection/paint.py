"""The paints on a floor: lines of several sports, each in a colour of its own.

A pixel on the edge of a line is a mixture of ground and paint, (1 - a) G + a P. Beside the ground it lies on,
pixel / G - 1 = a (P / G - 1) =: a D: the share `a` of a paint is linear in what is seen, and D is the same in light and
in shade, and for cameras of different exposure. So a frame can be drawn as one in which one paint alone is bright.
"""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Frame

SPREAD_RAD = 0.2
"""Spread of the colours of one paint, as an angle between differences: white and yellow on blue are 0.26 apart."""
COMPARED_WIDTH_PX = 1280
"""Width of the frames in which colours are compared: lines are wide enough there to show their paint."""
ROWS = 256
"""Rows of a frame that are processed at once: a frame of 4K would take 400 MB as numbers."""


def sort_colours(frames: Sequence[Frame], looked_at: Sequence[NDArray[np.bool_]]) -> Array:
    """Return the colours of lines on the floor, (K, 3): differences to the ground in blue, green and red, as shares.

    They are read off frames (H, W, 3) where each is `looked_at` (H, W), since it can show lines there.
    """
    seen = np.concatenate([_colours_of_lines(frame, its) for frame, its in zip(frames, looked_at, strict=True)])
    # Number of clusters into which the colours that stand out are sorted. Halls have up to six paints; one that shines,
    # or that another line touches, has two.
    most_colours = 8
    if len(seen) < most_colours:
        return np.empty((0, 3))
    hues = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    cv2.setRNGSeed(0)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    labels = cv2.kmeans(hues, most_colours, np.empty(0), criteria, 3, cv2.KMEANS_PP_CENTERS)[1][:, 0]
    colours: list[Array] = []
    for group in sorted((seen[labels == label] for label in range(most_colours)), key=len, reverse=True):
        colour = np.median(group, axis=0)
        # Clusters cut a paint in two where it is most of all that is seen.
        # Clusters of noise are smaller.
        if len(group) >= 0.03 * len(seen) and all(_angle(colour, other) > SPREAD_RAD for other in colours):
            colours.append(colour)
    return np.array(colours)


def _angle(one: Array, other: Array) -> float:
    return float(np.arccos(np.clip(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)), -1.0, 1.0)))


def draw_colours(frame: Frame, colours: Array, choices: Sequence[Sequence[int]]) -> list[Frame]:
    """Draw a frame (H, W, 3) in grey, once for each of the `choices` among the `colours` (K, 3) of its lines.

    The chosen ones are bright, and all else is as dark as the ground.
    """
    sizes = np.linalg.norm(colours, axis=1)
    directions = (colours / sizes[:, None]).T.astype(np.float32)
    drawn = [np.empty_like(frame) for _ in choices]
    # The share of a paint below which a pixel shows none: noise, and edges of other lines.
    faintest = 0.15
    for rows, difference in _differences(frame):
        along = difference @ directions
        size = np.linalg.norm(difference, axis=-1, keepdims=True)
        angle = np.arccos(np.clip(along / np.maximum(size, 1e-6), -1.0, 1.0))
        likelihood = np.exp(-0.5 * (angle / SPREAD_RAD) ** 2)
        # A colour unlike all of them belongs to none, and not to the nearest.
        belongs = likelihood / np.maximum(likelihood.sum(axis=-1, keepdims=True), np.exp(-0.5 * 2.0**2))
        share = np.clip(along / sizes.astype(np.float32), 0.0, 1.0)
        of_each = belongs * share
        for picture, chosen in zip(drawn, choices, strict=True):
            shown = np.clip((of_each[..., list(chosen)].sum(axis=-1) - faintest) / (1 - faintest), 0.0, 1.0)
            # Grey levels of the ground, and by how much paint is brighter.
            picture[rows] = (60.0 + 140.0 * shown)[..., None]
    return drawn


def _colours_of_lines(frame: Frame, looked_at: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return differences (N, 3) to the ground of pixels that differ most around them: the middles of lines."""
    colours = []
    for rows, difference in _differences(frame):
        size = np.linalg.norm(difference, axis=-1)
        peak = size >= cv2.dilate(size, np.ones((3, 3), np.uint8))
        # The least difference of a line from its ground, as a share of the ground's brightness, whose colour is read
        # off.
        colours.append(difference[peak & (size > 0.25) & looked_at[rows]])
    return np.concatenate(colours)


def _differences(frame: Frame) -> Iterator[tuple[slice, NDArray[np.float32]]]:
    """Yield rows of a frame, and how their pixels (h, W, 3) differ from the ground, as shares of its brightness."""
    height, width = frame.shape[:2]
    # Width of the reduced picture in which the ground is estimated: lines are thin there.
    factor = max(1, round(width / 640))
    small = cv2.resize(frame, (width // factor, height // factor), interpolation=cv2.INTER_AREA)
    # Side of the square whose median is the ground, px at that width: more than twice as wide as any line.
    ground = cv2.resize(cv2.medianBlur(small, 21), (width, height), interpolation=cv2.INTER_LINEAR)
    for top in range(0, height, ROWS):
        rows = slice(top, min(top + ROWS, height))
        # Grey levels added to all brightness: what is black anyway has no colour.
        pixels, there = (np.asarray(part[rows], dtype=np.float32) + np.float32(4.0) for part in (frame, ground))
        yield rows, pixels / there - 1
