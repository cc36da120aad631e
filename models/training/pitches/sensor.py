"""From light to a JPEG: air, drops on the glass, lens blur, colour fringe, exposure, noise, sharpening, compression."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.noise import Plane
from models.training.pitches.conditions import Conditions


def add_air(conditions: Conditions, colour: Plane, depth: Plane) -> Plane:
    """Air between camera and scene: a blue haze far away, and fog."""
    dim = np.float32(0.3 if conditions.light == "floodlight" else 1.0)
    share = 1 - np.exp(-depth * np.float32(0.0008 + 0.012 * conditions.fog))
    grey = np.float32([0.82, 0.8, 0.78] if conditions.fog else [0.8, 0.72, 0.66]) * dim
    return colour + share[..., None] * (grey - colour)


def expose(
    conditions: Conditions,
    picture: NDArray[np.uint8],
    origin: tuple[int, int],
    size: tuple[int, int],
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """Return the picture that the camera delivers of a window at `origin` of a frame of `size` (width, height).

    How the lens and the electronics behave hangs on the world's seed; only the noise hangs on `rng`.
    """
    lens = np.random.default_rng([conditions.world, 53])
    light = picture.astype(np.float32) / 255
    light = _drops(conditions, light, origin, size, lens)
    light = _blur(conditions, light, lens)
    light = _fringe(conditions, light, origin, size, lens)
    light = _tone(conditions, light, origin, size, lens)
    light = light + _grain(conditions, light, rng, lens)
    light = _sharpen(conditions, light, lens)
    frame = np.clip(light * 255 + 0.5, 0, 255).astype(np.uint8)
    _, packed = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, conditions.jpeg_quality])
    return cv2.imdecode(packed, cv2.IMREAD_COLOR)


def _drops(
    conditions: Conditions, light: Plane, origin: tuple[int, int], size: tuple[int, int], lens: np.random.Generator
) -> Plane:
    """Rain on the glass: round places where the picture is smeared and paler."""
    if not conditions.rain:
        return light
    height, width = light.shape[:2]
    share = np.zeros((height, width), np.float32)
    scale = size[0] / 1920
    for _ in range(int(40 * conditions.rain)):
        x, y = lens.uniform(0, 1, 2) * size - np.array(origin)
        radius = lens.uniform(8, 60) * scale
        if -radius < x < width + radius and -radius < y < height + radius:
            cv2.circle(share, (int(x), int(y)), int(radius), float(lens.uniform(0.5, 1)), -1, cv2.LINE_AA)
    if not share.any():
        return light
    share = cv2.GaussianBlur(share, (0, 0), 4 * scale)[..., None]
    smeared = cv2.blur(light, (int(24 * scale) | 1, int(24 * scale) | 1)) * 0.92 + 0.06
    return light + share * (smeared - light)


def _blur(conditions: Conditions, light: Plane, lens: np.random.Generator) -> Plane:
    """Defocus and a shaking pole."""
    sigma = 0.3 + 1.6 * conditions.blur * float(lens.uniform(0.4, 1.0))
    light = cv2.GaussianBlur(light, (0, 0), sigma)
    if lens.random() < 0.25:
        length = int(lens.uniform(2, 8) * conditions.blur) + 1
        if length > 1:
            kernel = np.zeros((2 * length + 1, 2 * length + 1), np.float32)
            angle = lens.uniform(0, np.pi)
            reach = length * np.array([np.cos(angle), np.sin(angle)]) / 2
            start, end = np.round((length - reach) * 16).astype(int), np.round((length + reach) * 16).astype(int)
            cv2.line(kernel, tuple(map(int, start)), tuple(map(int, end)), 1.0, 1, cv2.LINE_8, 4)
            light = cv2.filter2D(light, -1, kernel / kernel.sum())
    return light


def _fringe(
    conditions: Conditions, light: Plane, origin: tuple[int, int], size: tuple[int, int], lens: np.random.Generator
) -> Plane:
    """Blue and red at another magnification, and less sharp, than green: up to some pixels at the frame's edge."""
    if conditions.fringe < 0.05:
        return light
    height, width = light.shape[:2]
    middle = np.array(size) / 2 - np.array(origin)
    bands = []
    for channel, reach in ((0, 8.0), (1, 0.0), (2, 3.0)):
        plane = np.ascontiguousarray(light[..., channel])
        if reach:
            shift = conditions.fringe**1.5 * reach * float(lens.uniform(-1, 1)) / (size[0] / 2)
            move = np.float32([[1 + shift, 0, -shift * middle[0]], [0, 1 + shift, -shift * middle[1]]])
            plane = cv2.warpAffine(
                plane, move, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
            plane = cv2.GaussianBlur(plane, (0, 0), 0.2 + conditions.fringe * float(lens.uniform(0, 1.5)))
        bands.append(plane)
    return np.dstack(bands)


def _tone(
    conditions: Conditions, light: Plane, origin: tuple[int, int], size: tuple[int, int], lens: np.random.Generator
) -> Plane:
    """Exposure, white balance, contrast, saturation and the dark corners of the lens."""
    odd = 0.15 + 0.85 * conditions.variety
    gain = np.exp(odd * lens.normal(0, 0.12)) * np.exp(odd * lens.normal(0, 0.05, 3))
    light = light * gain.astype(np.float32)
    contrast, pivot = np.float32(1 + odd * lens.uniform(-0.2, 0.3)), np.float32(0.42)
    light = pivot + contrast * (light - pivot) + np.float32(odd * lens.normal(0, 0.03))
    grey = light.mean(axis=-1, keepdims=True)
    light = grey + np.float32(1 + odd * lens.uniform(-0.4, 0.35)) * (light - grey)
    height, width = light.shape[:2]
    x = (np.arange(width, dtype=np.float32) + origin[0]) / size[0] - 0.5
    y = (np.arange(height, dtype=np.float32) + origin[1]) / size[0] - 0.5 * size[1] / size[0]
    corner = np.float32(odd * lens.uniform(0, 0.9)) * (x[None] ** 2 + y[:, None] ** 2)
    return light * (1 - corner)[..., None]


def _grain(conditions: Conditions, light: Plane, rng: np.random.Generator, lens: np.random.Generator) -> Plane:
    """Sensor noise, as coarse as the camera's own noise filter leaves it."""
    height, width = light.shape[:2]
    luma = rng.standard_normal((height, width), dtype=np.float32)
    chroma = rng.standard_normal((height // 4 + 1, width // 4 + 1, 3), dtype=np.float32)
    coarse = float(lens.uniform(0, 1.0))
    if coarse > 0.35:
        luma = cv2.GaussianBlur(luma, (0, 0), coarse) * np.float32(1 + 2.2 * coarse)
    spread = np.float32(0.06 * conditions.noise) * np.sqrt(np.clip(light.mean(axis=-1), 0.05, 1))
    colourful = cv2.resize(chroma, (width, height), interpolation=cv2.INTER_LINEAR) * np.float32(0.4)
    return spread[..., None] * (luma[..., None] + colourful)


def _sharpen(conditions: Conditions, light: Plane, lens: np.random.Generator) -> Plane:
    """Unsharp masking with its halos."""
    if not conditions.sharpening:
        return light
    radius = float(lens.uniform(0.7, 2.2))
    amount = np.float32(conditions.sharpening * lens.uniform(0.8, 2.6))
    return light + amount * (light - cv2.GaussianBlur(light, (0, 0), radius))
