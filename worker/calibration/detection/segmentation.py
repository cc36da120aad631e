"""The segmentation of the paper, section III: which pixels of a frame are field markings, by the exported U-Net.

The network sees the frame as the camera took it. Undistorting first would stretch the edges of a wide picture to twice
as many pixels and blur what it stretches; the lens model is in the projection instead.

It sees frames of more than about 2.5K shrunk to half: a quarter of the work, and on a real pair of 3072 x 1728 pixels
the same poses to 0.01 px on clicked points. The refinement reads the frame itself.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field

if TYPE_CHECKING:
    import onnxruntime as ort

HALO_PX = 96
"""Context that answers depend on (three poolings of 2 x 2 px reach 92 px beyond a region), a multiple of the pooled."""
GRID_PX = 32
"""Regions begin and end on this grid: then the network pools the same pixels together as in the whole frame."""
REGION_PX = 1920
"""Largest width and height of a region: bounds the memory, whatever the size of the frame.

As large as memory allows, one after the other: small ones pay for their halos, and batches of them gain nothing.
"""
OVERVIEW_WIDTH_PX = 768
"""Width of an overview: a sixth of the pixels that the network sees of a 4K frame, and of their cost."""
WORKING_WIDTH_PX = 1920
"""Approximate width at which the network sees frames; the three lengths above are in such pixels."""


@dataclass(frozen=True)
class Region:
    """A rectangle of a frame, in pixels; `right` and `bottom` are the first column and row outside."""

    left: int
    top: int
    right: int
    bottom: int

    def shrunk(self, factor: int) -> "Region":
        """Return the rectangle in the frame shrunk by `factor`."""
        return Region(self.left // factor, self.top // factor, self.right // factor, self.bottom // factor)


class Segmenter:
    """The exported U-Net: `models/unet.onnx`, RGB 0..1 in, probability of a marking out.

    `provider`: what computes, by its name in ONNX Runtime. It is loaded when the network first looks at something,
    which raises `ProviderMissing` where it is not installed.
    """

    def __init__(self, model: Path, threads: int, provider: str = "CPUExecutionProvider") -> None:
        self._model, self._threads, self._provider = model, threads, provider
        self.sha256 = hashlib.sha256(model.read_bytes()).hexdigest()

    @cached_property
    def session(self) -> "ort.InferenceSession":
        """ONNX Runtime session of the network."""
        import onnxruntime as ort

        if self._provider not in ort.get_available_providers():
            raise ProviderMissing(self._provider, ort.get_available_providers())
        options = ort.SessionOptions()
        options.intra_op_num_threads = self._threads
        options.inter_op_num_threads = 1
        # Regions differ in size: memory planned for one does not fit the next.
        options.enable_mem_pattern = False
        # Threads that wait for the next layer, or for the next frame, would keep their cores busy: half of an overview.
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        return ort.InferenceSession(self._model, options, providers=[self._provider])

    @cached_property
    def input_name(self) -> str:
        """The name of the network's input, the picture."""
        name: str = self.session.get_inputs()[0].name
        return name

    @cached_property
    def _run_options(self) -> "ort.RunOptions":
        import onnxruntime as ort

        options = ort.RunOptions()
        # A run takes hundreds of megabytes, which search, judgement and pictures need after it.
        if self._provider == "CPUExecutionProvider":
            options.add_run_config_entry("memory.enable_memory_arena_shrinkage", "cpu:0")
        return options

    def __call__(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """Return probabilities of a BGR frame (H, W, 3) as (H, W) in 0..255; 0 outside the regions.

        Steps of 1/255 are finer than the network knows, and take away what threads change in the last digits.
        """
        height, width = frame.shape[:2]
        factor = shrinking((width, height))
        if factor == 1:
            return self._response(frame, regions)
        small = _resized(frame, (width // factor, height // factor), cv2.INTER_AREA)
        response = self._response(small, [region.shrunk(factor) for region in regions])
        return _resized(response, (width, height), cv2.INTER_LINEAR)

    def _response(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        response = np.zeros(frame.shape[:2], dtype=np.uint8)
        if frame.shape[1] <= OVERVIEW_WIDTH_PX:
            # The halos of its regions would be more than all of it.
            everything = self._all_of(frame)
            for region in regions:
                rows, columns = slice(region.top, region.bottom), slice(region.left, region.right)
                response[rows, columns] = everything[rows, columns]
            return response
        beyond = HALO_PX + GRID_PX
        padded = np.pad(frame, ((HALO_PX, beyond), (HALO_PX, beyond), (0, 0)), mode="reflect")
        for region in regions:
            seen = padded[region.top : region.bottom + 2 * HALO_PX, region.left : region.right + 2 * HALO_PX]
            inner = self._probabilities(seen)[HALO_PX:-HALO_PX, HALO_PX:-HALO_PX]
            there = response[region.top : region.bottom, region.left : region.right]
            there[...] = np.rint(inner[: there.shape[0], : there.shape[1]] * 255)
        return response

    def _all_of(self, frame: Frame) -> NDArray[np.uint8]:
        """Return probabilities (H, W) in 0..255 of a small frame, seen at once."""
        height, width = frame.shape[:2]
        padded = np.pad(frame, ((0, -height % GRID_PX), (0, -width % GRID_PX), (0, 0)), mode="reflect")
        return np.rint(self._probabilities(padded)[:height, :width] * 255).astype(np.uint8)

    def _probabilities(self, picture: NDArray[np.uint8]) -> NDArray[np.float32]:
        rgb = picture[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255
        (answer,) = self.session.run(None, {self.input_name: rgb}, self._run_options)
        return np.asarray(answer, dtype=np.float32)[0, 0]


def _resized(picture: NDArray[np.uint8], size: tuple[int, int], interpolation: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.resize(picture, size, interpolation=interpolation), dtype=np.uint8)


class ProviderMissing(Exception):  # noqa: N818
    """ONNX Runtime as installed lacks the requested provider."""

    def __init__(self, provider: str, available: Sequence[str]) -> None:
        super().__init__(f"ONNX Runtime here has no {provider}, only {', '.join(available)}.")


def shrinking(size: tuple[int, int]) -> int:
    """Return the factor by which a frame of `size` (width, height) is shrunk before the network sees it."""
    return max(1, round(size[0] / WORKING_WIDTH_PX))


def overview(frame: Frame) -> Frame:
    """Return a frame (H, W, 3) reduced to the width of an overview, in which the network sees wide lines."""
    height, width = frame.shape[:2]
    if width <= OVERVIEW_WIDTH_PX:
        return frame
    return _resized(frame, (OVERVIEW_WIDTH_PX, round(height * OVERVIEW_WIDTH_PX / width)), cv2.INTER_AREA)


def covered(regions: Sequence[Region], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return True for the pixels of a frame (H, W, ...) of this shape that lie in any of the regions."""
    inside = np.zeros(shape[:2], dtype=bool)
    for region in regions:
        inside[region.top : region.bottom, region.left : region.right] = True
    return inside


def whole_frame(size: tuple[int, int]) -> list[Region]:
    """Return regions that cover all of a frame of `size` (width, height)."""
    grid, largest = _grid(size)
    width, height = (_up_to(grid, side) for side in size)
    return [
        Region(left, top, min(left + largest, width), min(top + largest, height))
        for left in range(0, width, largest)
        for top in range(0, height, largest)
    ]


def reachable_regions(pitch: Field, camera: Camera, reach_px: float) -> list[Region]:
    """Return the regions of a frame in which a marking can be at most `reach_px` from where the pose puts it.

    Columns of a region's largest width, each cut to the rows that lines can reach there.
    """
    size = camera.intrinsics.size
    grid, largest = _grid(size)
    pixels = camera.project(pitch.line_points().position)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    return [
        Region(left, top, min(left + largest, _up_to(grid, size[0])), bottom)
        for left in range(0, size[0], largest)
        for top, bottom in _rows(_near_columns(pixels, left, left + largest, reach_px), size, reach_px)
    ]


def _grid(size: tuple[int, int]) -> tuple[int, int]:
    """Return step and largest side of regions, in pixels of a frame of `size`."""
    return GRID_PX * shrinking(size), REGION_PX * shrinking(size)


def _near_columns(pixels: Array, left: int, right: int, reach_px: float) -> Array:
    """Return rows (K,) of the pixels (N, 2) that can come between two columns."""
    return pixels[(pixels[:, 0] >= left - reach_px) & (pixels[:, 0] < right + reach_px), 1]


def _rows(y: Array, size: tuple[int, int], reach_px: float) -> Iterator[tuple[int, int]]:
    """Yield stretches of rows within `reach_px` of any of `y`, on the grid, each at most a region's largest height."""
    height = size[1]
    grid, largest = _grid(size)
    y = np.sort(y[(y >= -reach_px) & (y <= height - 1 + reach_px)])
    if len(y) == 0:
        return
    # Two stretches nearer to each other than their halos cost more apart than together.
    halo = HALO_PX * shrinking(size)
    for stretch in np.split(y, np.flatnonzero(np.diff(y) > 2 * (reach_px + halo)) + 1):
        top = max(0, int(stretch[0] - reach_px)) // grid * grid
        end = _up_to(grid, min(height, int(np.ceil(stretch[-1] + reach_px)) + 1))
        count = -(-(end - top) // largest)
        step = _up_to(grid, -(-(end - top) // count))
        yield from ((row, min(row + step, end)) for row in range(top, end, step))


def _up_to(grid: int, pixels: int) -> int:
    return -(-pixels // grid) * grid
