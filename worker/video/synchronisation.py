"""Time offset of two clips, by correlation of what moves in the places that both cameras see.

A coarse view of these places is divided into cells. How much each changes from one frame to the next is a signal for
each camera; what changes in all cells at once is taken out, since encoders refresh whole frames in a rhythm of their
own and lamps flicker. The lag at which the signals of all cells are most alike is the offset.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.geometry.field import Field
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.video.clips import ClipPicture

# How much of the clips is looked at, and how far off they may be.
LOOKED_AT_S, FARTHEST_S = 20.0, 2.0
# The coarse view, its cells, and how wide frames are made for it.
VIEW_WIDTH, CELL, FRAME_WIDTH = 640, 8, 960
# Changes of luma this small are noise.
NOISE = 3.0
# Fewer cells or seconds than this that both have say nothing.
LEAST_CELLS, LEAST_S = 4, 2.0
# How alike the signals are at least, 1 being the same; and how much of that no other lag may reach.
LEAST_STRENGTH, SECOND_BEST = 0.4, 0.6
# Lags this near belong to the same peak, in steps.
PEAK_STEPS = 2


@dataclass(frozen=True)
class OffsetEstimate:
    """Estimated offset of two clips. `second_s`: the first camera's time at the second one's 0, None if unclear.

    `strength`: how alike the changes are at the best lag, -1 to 1; `rival`: at the best other one.
    """

    second_s: float | None
    strength: float
    rival: float
    why: str = ""


@dataclass(frozen=True)
class MotionSignal:
    """Change of each cell of the coarse view: `change` (frames, cells) at `times` (frames,); `seen` (cells,)."""

    times: Array
    change: NDArray[np.float32]
    seen: NDArray[np.bool_]


class CoarseView:
    """The coarse view of what cameras see, which their frames are compared in."""

    def __init__(self, pitch: Field, cameras: Sequence[Camera]) -> None:
        view = chosen_view(pitch, cameras, ViewChoice(width=VIEW_WIDTH))
        width, height = (extent // CELL * CELL for extent in view.size)
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
        points = view.behind(pitch, pixels)
        self._at = {camera.id: camera.project(points) for camera in cameras}
        self._within = {camera.id: inside(self._at[camera.id], camera.intrinsics.size) for camera in cameras}
        self._size = {camera.id: camera.intrinsics.size for camera in cameras}

    def motion(self, camera: str, shots: Iterable[ClipPicture]) -> MotionSignal:
        """Return the motion signal of a camera's pictures."""
        width, _ = self._size[camera]
        scale = min(1.0, FRAME_WIDTH / width)
        at = (np.nan_to_num((self._at[camera] + 0.5) * scale - 0.5, nan=-1e3)).astype(np.float32)
        within = self._within[camera]
        share = _pooled(within.astype(np.float32))
        times, changes = [], []
        before: tuple[float, NDArray[np.float32]] | None = None
        for shot in shots:
            luma = shot.picture.planes[0]
            small = cv2.resize(luma, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.float32)
            seen = cv2.remap(small, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
            if before is not None:
                change = np.where(within, np.maximum(np.abs(seen - before[1]) - NOISE, 0), 0).astype(np.float32)
                times.append((shot.time_s + before[0]) / 2)
                changes.append(_pooled(change).ravel() / np.maximum(share.ravel(), 1e-6))
            before = shot.time_s, np.asarray(seen, np.float32)
        cells = share.size
        return MotionSignal(np.array(times), np.array(changes, np.float32).reshape(-1, cells), (share.ravel() > 0.5))

    def common(self, first: str, second: str) -> int:
        """Return the number of pixels of the coarse view that both see."""
        return int((self._within[first] & self._within[second]).sum())


def estimate_offset(first: MotionSignal, second: MotionSignal) -> OffsetEstimate:
    """Estimate when the second clip began, in the time of the first one."""
    both = first.seen & second.seen
    if both.sum() < LEAST_CELLS:
        return OffsetEstimate(None, 0.0, 0.0, "the cameras see no places in common")
    steps = [np.median(np.diff(motion.times)) for motion in (first, second) if len(motion.times) > 2]
    if len(steps) < 2 or min(np.ptp(first.times), np.ptp(second.times)) < LEAST_S:
        return OffsetEstimate(None, 0.0, 0.0, f"a clip is shorter than {LEAST_S:g} s")
    step = float(min(steps))
    signals = [_signal(motion, both, step) for motion in (first, second)]
    if any(signal is None for signal in signals):
        return OffsetEstimate(None, 0.0, 0.0, "nothing moves where both cameras see")
    one, other = (signal for signal in signals if signal is not None)
    start = second.times[0] - first.times[0]
    lags = np.arange(math.ceil((-FARTHEST_S + start) / step), math.floor((FARTHEST_S + start) / step) + 1)
    likeness = np.array([_likeness(one, other, int(lag)) for lag in lags])
    return _peak(likeness, lags * step - start)


def _signal(motion: MotionSignal, cells: NDArray[np.bool_], step: float) -> Array | None:
    """Return the changes (times, cells) in even steps, less what all cells share, or None if nothing moves."""
    grid = np.arange(motion.times[0], motion.times[-1], step)
    change = np.stack([np.interp(grid, motion.times, of_cell) for of_cell in motion.change[:, cells].T], axis=-1)
    own = change - np.median(change, axis=1, keepdims=True)
    own -= own.mean(axis=0)
    return own if np.abs(own).max() > NOISE / 3 else None


def _likeness(one: Array, other: Array, lag: int) -> float:
    """Return the correlation of two signals (times, cells), the other one's time `lag` steps later."""
    begin, end = max(0, lag), min(len(one), len(other) + lag)
    if end - begin < 2:
        return 0.0
    a, b = one[begin:end], other[begin - lag : end - lag]
    norm = math.sqrt(float(np.sum(a * a)) * float(np.sum(b * b)))
    return float(np.sum(a * b)) / norm if norm > 0 else 0.0


def _peak(likeness: Array, offsets: Array) -> OffsetEstimate:
    best = int(np.argmax(likeness))
    strength = float(likeness[best])
    inner = likeness[1:-1]
    peaks = 1 + np.flatnonzero((inner >= likeness[:-2]) & (inner >= likeness[2:]))
    rivals = [float(likeness[peak]) for peak in peaks if abs(peak - best) > PEAK_STEPS]
    rival = max(rivals, default=0.0)
    if strength < LEAST_STRENGTH:
        return OffsetEstimate(None, strength, rival, "what moves is not alike at any offset")
    if best in (0, len(likeness) - 1):
        return OffsetEstimate(
            None, strength, rival, f"they are likest at the end of what is searched, {FARTHEST_S:g} s"
        )
    if rival > SECOND_BEST * strength:
        return OffsetEstimate(None, strength, rival, "two offsets explain what moves about equally well")
    before, top, after = likeness[best - 1 : best + 2]
    bend = before - 2 * top + after
    part = 0.0 if bend >= 0 else float(np.clip((before - after) / (2 * bend), -0.5, 0.5))
    return OffsetEstimate(float(offsets[best] + part * (offsets[1] - offsets[0])), strength, rival)


def _pooled(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the means (h, w) of the cells of values (H, W)."""
    height, width = values.shape
    cells = values.reshape(height // CELL, CELL, width // CELL, CELL)
    return np.asarray(cells.mean(axis=(1, 3)), np.float32)


def chain_offsets(
    places: CoarseView, motions: Mapping[str, MotionSignal], known: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, OffsetEstimate]]:
    """Return when each camera's clip began, in the time of those `known`, and the estimates of the others.

    Each camera is put in time by the one of those already in time with which it has most in common.
    """
    offsets, found = dict(known), {}
    while rest := [camera for camera in motions if camera not in offsets and camera not in found]:
        pairs = [(places.common(done, camera), done, camera) for done in offsets for camera in rest]
        _, done, camera = max(pairs)
        found[camera] = estimate_offset(motions[done], motions[camera])
        if (second := found[camera].second_s) is not None:
            offsets[camera] = offsets[done] + second
    return offsets, found
