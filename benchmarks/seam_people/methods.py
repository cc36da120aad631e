"""Seams to compare: each takes the frames of a moment and says how much each camera counts in each pixel."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.seam_people.game import RATE
from worker.calibration.geometry.camera import Frame, inside
from worker.calibration.stitching.panorama import Panorama
from worker.calibration.stitching.people_seam import blend_shares, seam_bands

Weights = Sequence[NDArray[np.float32]]
# OpenCV's finders run on pictures half as large, of a fifth of a megapixel: its own stitcher takes a tenth.
SHRINK = 2
# Of so many pictures the graph cut takes one: it needs core-seconds for each.
RARELY = 10


@dataclass
class Method:
    """A seam: `weigh` takes what each camera shows (H, W, 3); `took_s`: process seconds of all calls.

    `every`: of so many pictures it takes one.
    """

    name: str
    weigh: Callable[[Sequence[NDArray[np.float32]]], Weights]
    every: int = 1
    took_s: float = field(default=0.0, init=False)
    calls: int = field(default=0, init=False)

    def weights(self, shown: Sequence[NDArray[np.float32]]) -> Weights:
        """Return the weights (H, W) of each camera, of pictures of the whole view."""
        began = time.process_time()
        found = self.weigh(shown)
        self.took_s += time.process_time() - began
        self.calls += 1
        return found


def methods(made: Panorama, on_pitch: NDArray[np.bool_]) -> list[Method]:
    """Return the seams of a panorama."""
    static = [part.weight for part in made.parts]
    seen = [inside(part.source, part.frame_size, 1.0) for part in made.parts]
    feather = _feather(seen)
    return [
        Method("static seam", lambda _: static),
        Method("feather", lambda _: feather),
        Method("DpSeamFinder", lambda shown: _opencv(cv2.detail.DpSeamFinder("COLOR_GRAD"), shown, seen)),
        Method(
            "GraphCut", lambda shown: _opencv(cv2.detail.GraphCutSeamFinder("COST_COLOR_GRAD"), shown, seen), RARELY
        ),
        Method("people", _People(made, on_pitch)),
    ]


def shown_by(
    made: Panorama, rises: Sequence[NDArray[np.float32]], frames: Mapping[str, Frame]
) -> list[NDArray[np.float32]]:
    """Return what each camera shows (H, W, 3) of the whole view, evened out; `rises` (H, W, 1): `Contribution.rise`."""
    found = []
    for part, rise in zip(made.parts, rises, strict=True):
        raw = cv2.remap(frames[part.camera], part.source, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        found.append(np.asarray(cv2.LUT(raw, part.light.tones[:, None]), np.float32) * rise)
    return found


class _People:
    """The seams of `esc stitch --seam people`."""

    def __init__(self, made: Panorama, on_pitch: NDArray[np.bool_]) -> None:
        self._made, self._bands = made, seam_bands(made, on_pitch, RATE)

    def __call__(self, shown: Sequence[NDArray[np.float32]]) -> Weights:
        weights = [part.weight.copy() for part in self._made.parts]
        for band in self._bands:
            rows, columns = band.pixels
            size = band.zone.shape[::-1]
            first, second = (
                cv2.resize(shown[number][rows, columns], size, interpolation=cv2.INTER_AREA) for number in band.cameras
            )
            i, j = band.cameras
            weights[j][rows, columns] = blend_shares(*band.update(first, second), weights[j][rows, columns])
            total = self._made.parts[i].weight[rows, columns] + self._made.parts[j].weight[rows, columns]
            weights[i][rows, columns] = total - weights[j][rows, columns]
        return weights


def _feather(seen: Sequence[NDArray[np.bool_]]) -> Weights:
    """Weights by the distance to the border of what a camera sees."""
    far = np.stack([cv2.distanceTransform(np.pad(one, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1] for one in seen])
    return list((far / np.maximum(far.sum(axis=0), 1e-9)).astype(np.float32))


def _opencv(finder: Any, shown: Sequence[NDArray[np.float32]], seen: Sequence[NDArray[np.bool_]]) -> Weights:
    height, width = seen[0].shape
    size = width // SHRINK, height // SHRINK
    small = [cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in shown]
    if isinstance(finder, cv2.detail.DpSeamFinder):
        small = [np.clip(one, 0, 255).astype(np.uint8) for one in small]
    masks = [cv2.resize(one.astype(np.uint8) * 255, size, interpolation=cv2.INTER_NEAREST) for one in seen]
    found = finder.find([cv2.UMat(one) for one in small], len(small) * [(0, 0)], [cv2.UMat(one) for one in masks])
    masks = [one.get() if isinstance(one, cv2.UMat) else one for one in found]
    full = [cv2.resize(one, (width, height), interpolation=cv2.INTER_LINEAR) > 127 for one in masks]
    first = np.argmax(full, axis=0)
    return [((first == number) & np.any(full, axis=0)).astype(np.float32) for number in range(len(full))]
