"""The segmentation of the paper, section III: which pixels of a frame are field markings, by the exported U-Net.

The network sees the frame as the camera took it. Undistorting first would stretch the edges of a wide picture to twice
as many pixels and blur what it stretches; the lens model is in the projection instead.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from worker.calibration.camera import Array, Camera
from worker.calibration.field import Field

HALO_PX = 96
"""Context a pixel's answer depends on (half the receptive field of four poolings, 94 px, on the network's grid)."""
CORE_PX = 448
"""Side of the square that one tile answers for."""
GRID_PX = 32
"""The network takes sides that are multiples of this."""


class Segmenter:
    """The exported U-Net: `models/unet.onnx`, RGB 0..1 in, probability of a marking out."""

    def __init__(self, model: Path, threads: int) -> None:
        options = ort.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        # The arena keeps the largest tile's memory and grows no further: all tiles have one size.
        self.session = ort.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        self.sha256 = hashlib.sha256(model.read_bytes()).hexdigest()
        self.input_name = self.session.get_inputs()[0].name

    def __call__(self, frame: NDArray[np.uint8], wanted: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Probabilities of a BGR frame (H, W, 3) as (H, W) in 0..255.

        `wanted` (rows, columns): which tiles to look at (see `reachable_tiles`); 0 elsewhere. Steps of 1/255 are finer
        than the network knows and take away what threads change in the last digits.
        """
        height, width = frame.shape[:2]
        response = np.zeros((height, width), dtype=np.uint8)
        bottom = wanted.shape[0] * CORE_PX - height + HALO_PX
        right = wanted.shape[1] * CORE_PX - width + HALO_PX
        padded = np.pad(frame, ((HALO_PX, bottom), (HALO_PX, right), (0, 0)), mode="reflect")
        side = CORE_PX + 2 * HALO_PX
        for row, column in np.argwhere(wanted):
            top, left = row * CORE_PX, column * CORE_PX
            tile = padded[top : top + side, left : left + side]
            core = self._probabilities(tile)[HALO_PX:-HALO_PX, HALO_PX:-HALO_PX]
            there = response[top : top + CORE_PX, left : left + CORE_PX]
            there[...] = np.rint(core[: there.shape[0], : there.shape[1]] * 255)
        return response

    def _probabilities(self, tile: NDArray[np.uint8]) -> NDArray[np.float32]:
        rgb = tile[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255
        (answer,) = self.session.run(None, {self.input_name: rgb})
        return np.asarray(answer, dtype=np.float32)[0, 0]


def reachable_tiles(pitch: Field, camera: Camera, reach_px: float) -> NDArray[np.bool_]:
    """Which tiles (rows, columns) a marking can fall into when it is at most `reach_px` from where the pose puts it."""
    width, height = camera.intrinsics.size
    rows, columns = -(-height // CORE_PX), -(-width // CORE_PX)
    pixels = camera.project(pitch.line_points().position)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    near = _distance_to_tiles(pixels, rows, columns) <= reach_px
    return np.any(near, axis=0)


def _distance_to_tiles(pixels: Array, rows: int, columns: int) -> Array:
    """Chebyshev distance (N, rows, columns) in px of each pixel (N, 2) to each tile."""
    left, top = np.arange(columns) * CORE_PX, np.arange(rows) * CORE_PX
    dx = np.maximum(left - pixels[:, :1], pixels[:, :1] - (left + CORE_PX - 1)).clip(min=0)
    dy = np.maximum(top - pixels[:, 1:], pixels[:, 1:] - (top + CORE_PX - 1)).clip(min=0)
    return np.maximum(dx[:, None, :], dy[:, :, None])


def fuse(responses: Sequence[NDArray[np.uint8]]) -> NDArray[np.float32]:
    """Responses (H, W) of several frames of one camera as one in 0..1: the median, in which what walks by vanishes."""
    still = responses[0] if len(responses) == 1 else np.median(np.stack(responses), axis=0)
    return still.astype(np.float32) / np.float32(255)
