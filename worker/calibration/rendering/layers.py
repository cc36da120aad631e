"""Transparent pictures, BGRA, to be laid over a frame or the preview: what a person switches on and off to compare."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.rendering.overlays import EDGE_GAP, centre_lines, draw_line, frame_of
from worker.calibration.rendering.palette import Palette

Layer = NDArray[np.uint8]


def stored_layer(pitch: Field, camera: Camera, size: tuple[int, int]) -> Layer:
    """Draw the centre of each marking by the stored pose; `size`: width, height of the picture it is laid over."""
    # Two strokes of the new pose frame what one of the stored pose hits.
    return _of(Palette.STORED, _strokes(camera, centre_lines(pitch, camera), size, _thickness(0.0016, size)))


def new_layer(pitch: Field, camera: Camera, size: tuple[int, int]) -> Layer:
    """Draw the edges of each marking by the new pose: the paint stays visible between them."""
    thickness = _thickness(0.001, size)
    gap = EDGE_GAP * thickness * camera.intrinsics.size[0] / size[0]
    lines = [line for marking in pitch.markings() for line in frame_of(pitch, camera, marking, gap)]
    return _of(Palette.NEW, _strokes(camera, lines, size, thickness))


def mask_layer(response: NDArray[np.uint8], size: tuple[int, int]) -> Layer:
    """Draw the network's response; `response` (h, w), of the frame or of an overview: its probability in 0..255."""
    # Lines are thinner than what is left of them in a smaller picture: the strongest stays, not the mean.
    reach = max(1, round(response.shape[1] / size[0]))
    strongest = cv2.dilate(response, np.ones((reach, reach), np.uint8))
    alpha = cv2.resize(strongest, size, interpolation=cv2.INTER_AREA)
    # Nobody sees more steps of it, and every one makes the file larger; below the first, the network says no.
    mask_steps = 8
    stepped = np.floor(alpha / 256 * mask_steps) / (mask_steps - 1)
    # Nothing on a field is of this colour.
    # The frame stays visible through a mask that is sure.
    return _of((255, 60, 230), np.rint(255 * 0.8 * stepped).astype(np.uint8))


def seam_layer(owner: NDArray[np.int8]) -> Layer:
    """Draw, dashed, the lines where one camera hands over to another; `owner` as in `Panorama.owner`."""
    seam = np.zeros(owner.shape, np.uint8)
    for axis in (0, 1):
        one, other = (np.take(owner, range(k, owner.shape[axis] - 1 + k), axis) for k in (0, 1))
        changes = (one != other) & (one >= 0) & (other >= 0)
        seam[: changes.shape[0], : changes.shape[1]] |= changes.astype(np.uint8)
    wide = cv2.dilate(seam, np.ones((2, 2), np.uint8))
    rows, columns = np.indices(owner.shape)
    # Nothing on a field is of this colour.
    return _of((0, 235, 255), np.where((rows + columns) // 14 % 2 == 0, 255 * wide, 0).astype(np.uint8))


def _thickness(part: float, size: tuple[int, int]) -> int:
    """Return a part of a picture's width, in pixels."""
    return max(1, round(part * size[0]))


def _strokes(camera: Camera, lines: Sequence[Array], size: tuple[int, int], thickness: int) -> NDArray[np.uint8]:
    """Return the coverage (height, width) in 0..255 of lines (n, 2) in a camera's pixels, in a smaller picture."""
    coverage = np.zeros((size[1], size[0]), np.uint8)
    scale = np.array(size) / np.array(camera.intrinsics.size)
    for line in lines:
        draw_line(coverage, (line + 0.5) * scale - 0.5, (255,), thickness)
    return coverage


def _of(colour: tuple[int, int, int], alpha: NDArray[np.uint8]) -> Layer:
    return np.dstack([np.full((*alpha.shape, 3), colour, np.uint8), alpha])
