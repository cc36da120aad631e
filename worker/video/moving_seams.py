"""Seams of a video that go around people: what both cameras show beside each seam, coarsely, and the shares of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.stitching.panorama import Contribution, Panorama
from worker.calibration.stitching.people_seam import SeamBand, Values, blend_shares, opened
from worker.video.renderer import Map, Planes, Share, median_level, sample_plane, sampling_map
from worker.video.yuv_planes import FROM_PLANES


class MovingSeams:
    """Seams of a panorama that go around people in its `bands`. `weights` (H, W) by camera: where it may be shown."""

    def __init__(self, panorama: Panorama, bands: Sequence[SeamBand]) -> None:
        self.weights: Sequence[NDArray[np.float32]] = opened(panorama, bands)
        self._bands = bands
        self._static = [_static_share(panorama, band) for band in bands]
        self._levels = [[_level(panorama.parts[number], band) for number in band.cameras] for band in bands]
        self.move(panorama)

    def move(self, panorama: Panorama) -> None:
        """Take the sampling maps of a panorama of which sources alone have moved."""
        self._samplers = [
            [
                _Sampler.of(panorama.parts[number], band, level)
                for number, level in zip(band.cameras, levels, strict=True)
            ]
            for band, levels in zip(self._bands, self._levels, strict=True)
        ]

    @property
    def levels(self) -> Sequence[tuple[int, int]]:
        """Cameras and the levels of detail at which they are sampled."""
        return [
            (number, level)
            for band, levels in zip(self._bands, self._levels, strict=True)
            for number, level in zip(band.cameras, levels, strict=True)
        ]

    def update(self, levels: Sequence[Mapping[int, Planes]], shares: Sequence[Share]) -> None:
        """Take the frames of a moment at each level of detail, and put the shares of it in place."""
        for band, static in zip(self._bands, self._static, strict=True):
            shares[band.cameras[1]].luma[band.pixels] = static
        for band, samplers in zip(self._bands, self._samplers, strict=True):
            values = [sampler.values(levels[number]) for number, sampler in zip(band.cameras, samplers, strict=True)]
            share = shares[band.cameras[1]]
            luma = blend_shares(*band.update(*values), share.luma[band.pixels])
            share.luma[band.pixels] = luma
            rows, columns = (slice(part.start // 2, part.stop // 2) for part in band.pixels)
            size = luma.shape[1] // 2, luma.shape[0] // 2
            share.chroma[rows, columns] = cv2.resize(luma, size, interpolation=cv2.INTER_AREA)


@dataclass(frozen=True)
class _Sampler:
    """Samples the cells (h, w) of a band from a camera's planes, evened out with the other cameras'.

    Luma of a cell is the mean of four places (2h, 2w), so that thin lines do not move with the pixels of a frame.
    """

    level: int
    luma: Map
    chroma: Map
    tones: NDArray[np.uint8]
    rise: NDArray[np.float32]

    @classmethod
    def of(cls, part: Contribution, band: SeamBand, level: int) -> "_Sampler":
        """Return the sampler of a camera."""
        cells = _places(part, band)
        tones = np.clip(np.rint(part.light.tones), 0, 255).astype(np.uint8)[:, None]
        rise = np.repeat(part.light.rise(cells, part.frame_size)[..., None], 3, axis=-1)
        return cls(level, sampling_map(_places(part, band, 2), level), sampling_map(cells, level + 1), tones, rise)

    def values(self, levels: Mapping[int, Planes]) -> Values:
        """Return blue, green, red (h, w, 3) of a frame at each level of detail."""
        luma, *colours = levels[self.level]
        blue, red = (sample_plane(plane, self.chroma) for plane in colours)
        mean = cv2.resize(sample_plane(luma, self.luma), blue.shape[::-1], interpolation=cv2.INTER_AREA)
        toned = cv2.LUT(cv2.transform(cv2.merge([mean, blue, red]), FROM_PLANES), self.tones)
        return np.asarray(cv2.multiply(toned.astype(np.float32), self.rise), np.float32)


def _places(part: Contribution, band: SeamBand, finer: int = 1) -> Map:
    """Return the places in a camera's frame of a band's cells (h, w, 2), or of cells so much finer."""
    height, width = band.zone.shape
    size = finer * width, finer * height
    return np.asarray(cv2.resize(part.source[band.pixels], size, interpolation=cv2.INTER_AREA), np.float32)


def _level(part: Contribution, band: SeamBand) -> int:
    return max(0, median_level(_places(part, band), band.zone > 0) - 1)


def _static_share(panorama: Panorama, band: SeamBand) -> NDArray[np.float32]:
    """Return how much the second camera counts before those drawn earlier, in the pixels of a band."""
    second = band.cameras[1]
    weights = np.stack([part.weight[band.pixels] for part in panorama.parts[: second + 1]])
    return np.asarray(weights[-1] / np.maximum(weights.sum(axis=0), np.float32(1e-9)), np.float32)
