"""Photometric correction of a camera's picture: exposure, white balance, darker corners, and the place of its seam."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array

# The grey level that a contrast leaves as it is.
MIDDLE = 100.0


@dataclass(frozen=True)
class Light:
    """Correction of a camera's picture, by which it agrees with the others'.

    `gain`: the factor on a middling blue, green and red (`MIDDLE`). `contrast`: how much steeper its tones become, an
    exponent less 1, since makers bend them differently. `falloff`: the log ratio of the factors in the corners and in
    the middle; it rises with the square of the distance from the middle of the frame, which stands for the optical
    axis. `reach`: the logarithm by which it counts more than how finely it sees; that moves the seams between it and
    others.
    """

    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    contrast: float = 0.0
    falloff: float = 0.0
    reach: float = 0.0

    @property
    def tones(self) -> NDArray[np.float32]:
        """Blue, green and red (256, 3) for each grey level 0 to 255 in the middle of the frame."""
        tone = MIDDLE * (np.arange(256) / MIDDLE) ** (1 + self.contrast)
        return (tone[:, None] * np.array(self.gain)).astype(np.float32)

    def rise(self, pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
        """Return the further factor on pixels (..., 2) of a frame of `size` (width, height)."""
        return np.exp(np.float32(self.falloff) * squared_radius(pixels, size))

    def after(self, before: "Light | None") -> "Light":
        """Return the correction smoothed with the one `before`: a cloud moves only a part of it."""
        if before is None:
            return self
        old, new = before.numbers, self.numbers
        return Light.of(old + 0.25 * (new - old))

    @property
    def numbers(self) -> Array:
        """Log gains of blue, green and red, contrast, falloff, reach (6,)."""
        return np.array([*np.log(self.gain), self.contrast, self.falloff, self.reach])

    @classmethod
    def of(cls, numbers: Array) -> "Light":
        """Return the correction of its `numbers`."""
        blue, green, red = np.exp(numbers[:3]).tolist()
        return cls((blue, green, red), *map(float, numbers[3:]))


NEUTRAL = Light()


def squared_radius(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return squares (...) of the distances of pixels (..., 2) from the middle of a frame, 1 in its corners."""
    half = (np.array(size, np.float32) - 1) / 2
    offset = (pixels - half) / np.float32(np.hypot(*half))
    square: NDArray[np.float32] = np.sum(offset * offset, axis=-1)
    return square
