"""Any camera there is: its light, glass, sensor and compression, drawn at random, the same for pictures side by side.

`pitches/sensor.py` is the fixed pitch camera in detail. This is the world's: grey and infrared, dark, blinded, fogged,
out of focus in half of the picture, denoised, compressed to blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.noise import Plane
from worker.calibration.geometry.camera import Array


@dataclass(frozen=True)
class Capture:
    """One camera at one moment: `optics` is what it does to light (H, W, 3), `electronics` what comes after.

    `noise`: standard deviation of its sensor on grey, in 0..1.
    """

    optics: tuple[Callable[[Plane], Plane], ...]
    noise: float
    coarse: float
    sharpening: float
    denoising: int
    quality: int
    shrunk: float

    def seen(self, light: Plane) -> Plane:
        """Return the light that falls on the sensor, without noise."""
        for effect in self.optics:
            light = effect(light)
        return np.clip(light, 0, 1)

    def delivered(self, seen: Plane, rng: np.random.Generator) -> NDArray[np.uint8]:
        """The frame: noise, its filter, sharpening, JPEG."""
        height, width = seen.shape[:2]
        grain = rng.standard_normal((height, width, 1), dtype=np.float32)
        colourful = rng.standard_normal((height, width, 3), dtype=np.float32) * np.float32(0.5)
        grain = grain + colourful
        if self.coarse > 0.3:
            grain = cv2.GaussianBlur(grain, (0, 0), self.coarse) * np.float32(1 + 2 * self.coarse)
        picture = seen + np.float32(self.noise) * np.sqrt(np.clip(seen, 0.05, 1)) * grain
        if self.sharpening:
            picture = picture + np.float32(self.sharpening) * (picture - cv2.GaussianBlur(picture, (0, 0), 1.2))
        frame = np.clip(picture * 255 + 0.5, 0, 255).astype(np.uint8)
        if self.denoising:
            frame = cv2.bilateralFilter(frame, 5, self.denoising, 3) if self.denoising > 8 else cv2.medianBlur(frame, 3)
        if self.shrunk < 1:
            # By its size: a factor would be taken as it is, and put the far edge beside itself.
            size = (round(width * self.shrunk), round(height * self.shrunk))
            small = cv2.resize(frame, size, interpolation=cv2.INTER_AREA)
            frame = cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
        _, packed = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, self.quality])
        return cv2.imdecode(packed, cv2.IMREAD_COLOR)


def random_capture(rng: np.random.Generator) -> Capture:
    """Any camera in any light, for a crop from anywhere in its frame."""
    return _random(rng, _crop_fringe)


def random_frame_capture(rng: np.random.Generator) -> Capture:
    """Any camera in any light, for its whole frame."""
    return _random(rng, _frame_fringe)


def _random(rng: np.random.Generator, fringe: Callable[[np.random.Generator], Callable[[Plane], Plane]]) -> Capture:
    optics: list[Callable[[Plane], Plane]] = [_blur(rng)]
    for chance, effect in (
        (0.25, _half_out_of_focus),
        (0.05, _shake),
        (0.3, fringe),
        (0.12, _veil),
        (0.08, _glare),
        (0.06, _drops),
        (0.3, _vignette),
    ):
        if rng.random() < chance:
            optics.append(effect(rng))
    optics.append(_tone(rng))
    kind = rng.choice(["colour", "grey", "infrared"], p=[0.82, 0.12, 0.06])
    if kind != "colour":
        optics.append(_grey(rng, infrared=kind == "infrared"))
    return Capture(
        tuple(optics),
        noise=float(np.exp(rng.uniform(np.log(0.002), np.log(0.035)))),
        coarse=float(rng.uniform(0, 1.0)),
        sharpening=float(rng.uniform(0, 2.0)) if rng.random() < 0.4 else 0.0,
        denoising=int(rng.integers(5, 40)) if rng.random() < 0.15 else 0,
        quality=int(rng.integers(35, 99)),
        shrunk=float(rng.uniform(0.5, 0.9)) if rng.random() < 0.15 else 1.0,
    )


def _blur(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    sigma = float(np.exp(rng.uniform(np.log(0.3), np.log(2.0))))
    return lambda light: cv2.GaussianBlur(light, (0, 0), sigma)


def _slope(rng: np.random.Generator, light: Plane) -> Plane:
    """A smooth step (H, W, 1) from 0 to 1 across the picture, some way."""
    height, width = light.shape[:2]
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    angle, at, soft = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.8), rng.uniform(0.05, 0.5)
    along = (np.cos(angle) * (x / width - 0.5) + np.sin(angle) * (y / height - 0.5)) + 0.5
    return np.clip((along - at) / soft + 0.5, 0, 1).astype(np.float32)[..., None]


def _with(seed: int, effect: Callable[[np.random.Generator, Plane], Plane]) -> Callable[[Plane], Plane]:
    """An effect that does the same to every picture it is shown."""
    return lambda light: effect(np.random.default_rng(seed), light)


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(1 << 40))


def _half_out_of_focus(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    sigma = float(rng.uniform(1, 4))

    def effect(rng: np.random.Generator, light: Plane) -> Plane:
        return light + _slope(rng, light) * (cv2.GaussianBlur(light, (0, 0), sigma) - light)

    return _with(_seed(rng), effect)


def _shake(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    length, angle = int(rng.integers(2, 9)), rng.uniform(0, np.pi)
    kernel = np.zeros((2 * length + 1, 2 * length + 1), np.float32)
    reach = length / 2 * np.array([np.cos(angle), np.sin(angle)])
    start, end = (np.round(length + side * reach).astype(int).tolist() for side in (-1, 1))
    cv2.line(kernel, start, end, 1.0, 1)
    return lambda light: cv2.filter2D(light, -1, kernel / kernel.sum())


def _crop_fringe(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    """Blue and red beside green, as lenses put them towards the edges of the frame."""
    move, share = rng.normal(0, 1.3, 2), float(rng.uniform(-0.8, 0.4))

    def shift(_size: tuple[int, int], part: float) -> Array:
        return np.array([[1, 0, part * move[0]], [0, 1, part * move[1]]])

    return _apart(shift, share)


def _frame_fringe(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    """Blue and red in another size than green, by up to some pixels at the edges."""
    grown, share = float(rng.normal(0, 1.3)), float(rng.uniform(-0.8, 0.4))

    def scale(size: tuple[int, int], part: float) -> Array:
        factor = part * grown / (max(size) / 2)
        return np.array([[1 + factor, 0, -factor * (size[0] - 1) / 2], [0, 1 + factor, -factor * (size[1] - 1) / 2]])

    return _apart(scale, share)


def _apart(move: Callable[[tuple[int, int], float], Array], red: float) -> Callable[[Plane], Plane]:
    """Blue moved by what `move` says (2, 3) for a picture (width, height), and red by a part of it."""

    def effect(light: Plane) -> Plane:
        size = (light.shape[1], light.shape[0])
        planes = [np.ascontiguousarray(light[..., channel]) for channel in range(3)]
        for channel, part in ((0, 1.0), (2, red)):
            planes[channel] = cv2.warpAffine(planes[channel], move(size, part), size, borderMode=cv2.BORDER_REPLICATE)
        return np.dstack(planes)

    return effect


def _veil(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    """Fog, or a film on the glass."""
    share, level = float(rng.uniform(0.2, 0.85)), float(rng.uniform(0.4, 0.9))
    even = rng.random() < 0.5

    def effect(rng: np.random.Generator, light: Plane) -> Plane:
        cover = np.float32(share) * (np.float32(1) if even else _slope(rng, light))
        return light + cover * (np.float32(level) - light)

    return _with(_seed(rng), effect)


def _glare(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    """The sun or a lamp, or its mirror image on the ground."""

    def effect(rng: np.random.Generator, light: Plane) -> Plane:
        height, width = light.shape[:2]
        y, x = np.mgrid[0:height, 0:width].astype(np.float32)
        cx, cy = rng.uniform(-0.2, 1.2, 2) * (width, height)
        wide, high = np.exp(rng.uniform(np.log(0.1), np.log(0.6), 2)) * (width, height)
        spot = np.exp(-(((x - cx) / wide) ** 2) - ((y - cy) / high) ** 2) * np.float32(rng.uniform(0.2, 1.2))
        return light + spot[..., None] * np.float32(rng.uniform(0.8, 1.0, 3))

    return _with(_seed(rng), effect)


def _drops(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    def effect(rng: np.random.Generator, light: Plane) -> Plane:
        share = np.zeros(light.shape[:2], np.float32)
        for _ in range(rng.integers(1, 6)):
            x, y = rng.uniform(0, share.shape[0], 2).astype(int).tolist()
            cv2.circle(share, (x, y), int(rng.uniform(8, 70)), float(rng.uniform(0.5, 1)), -1)
        share = cv2.GaussianBlur(share, (0, 0), 5)[..., None]
        return light + share * (cv2.blur(light, (21, 21)) * np.float32(0.9) + np.float32(0.05) - light)

    return _with(_seed(rng), effect)


def _vignette(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    dark = np.float32(rng.uniform(0.1, 0.6))
    return _with(_seed(rng), lambda rng, light: light * (1 - dark * _slope(rng, light)))


def _tone(rng: np.random.Generator) -> Callable[[Plane], Plane]:
    """Exposure from night to blown out, white balance, contrast, saturation."""
    dark = rng.random() < 0.08
    gain = np.exp(rng.normal(-1.5, 0.3) if dark else rng.normal(0, 0.25)) * np.exp(rng.normal(0, 0.12, 3))
    power, saturation = np.exp(rng.normal(0, 0.2)), np.float32(np.clip(rng.normal(0.95, 0.3), 0, 1.8))

    def effect(light: Plane) -> Plane:
        light = np.clip(light, 0, None) ** np.float32(power) * gain.astype(np.float32)
        grey = light.mean(axis=-1, keepdims=True)
        return grey + saturation * (light - grey)

    return effect


def _grey(rng: np.random.Generator, *, infrared: bool) -> Callable[[Plane], Plane]:
    weights = rng.dirichlet([1, 1, 4] if infrared else [1, 4, 2]).astype(np.float32)
    return lambda light: np.repeat((light @ weights)[..., None], 3, axis=-1)
