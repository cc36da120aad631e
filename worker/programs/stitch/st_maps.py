"""A stitched view as ST maps: an EXR file of each camera, where to sample its frame and how much it counts."""

from typing import Literal

import numpy as np

from worker.calibration.rendering.st_maps import NOWHERE
from worker.calibration.stitching.panorama import Contribution, Panorama
from worker.programs.exr import exr

Origin = Literal["top-left", "bottom-left"]


def files(made: Panorama, origin: Origin) -> dict[str, bytes]:
    """EXR files by name. Red and green: 0 to 1 from the outer corner at the `origin`; alpha: the weight."""
    return {f"{part.camera}.exr": exr("RGBA", _pixels(part, origin)) for part in made.parts}


def _pixels(part: Contribution, origin: Origin) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """Red, green, an empty blue, and alpha, (H, W, 4)."""
    height, width = part.weight.shape
    pixels = np.zeros((height, width, 4), np.float32)
    pixels[..., :2] = (part.source + 0.5) / np.array(part.frame_size, np.float32)
    if origin == "bottom-left":
        pixels[..., 1] = 1 - pixels[..., 1]
    pixels[part.weight <= 0, :2] = NOWHERE
    pixels[..., 3] = part.weight
    return pixels
