"""Pictures of what the network saw of each frame, which nothing else can tell later."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Camera
from worker.calibration.rendering.layers import mask_layer
from worker.jobs.from_schemas import encode_png

FRAME_WIDTH = 1920
"""Width of the frames that layers are laid over, px: a wide screen."""


def masks(cameras: Sequence[Camera], responses: Mapping[str, NDArray[np.float32]]) -> dict[str, bytes]:
    """Draw the network's responses (h, w), in 0..1, to be laid over the frames."""
    files = {}
    for camera in cameras:
        in_bytes = np.rint(255 * responses[camera.id]).astype(np.uint8)
        files[f"mask_{camera.id}"] = encode_png(mask_layer(in_bytes, size_as_shown(camera, in_bytes.shape[1])))
    return files


def size_as_shown(camera: Camera, largest: int = FRAME_WIDTH) -> tuple[int, int]:
    """Width and height of a frame as it is shown, at most as wide as the `largest` picture of it."""
    width, height = camera.intrinsics.size
    shown = min(width, largest, FRAME_WIDTH)
    return shown, round(height * shown / width)
