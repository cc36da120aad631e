"""Defects of a view, done to good frames: light, air, lens, weather, and things in front."""

import cv2
import numpy as np
from numpy.typing import NDArray

Frame = NDArray[np.uint8]


def _grainy(picture, seed: int = 0, noise: float = 1.2) -> Frame:
    grain = np.random.default_rng(seed).normal(scale=noise, size=picture.shape)
    return np.clip(picture + grain, 0, 255).astype(np.uint8)


def _cloud(shape, grain_px: float, seed: int = 0):
    """Smooth noise (H, W) of standard deviation about 1."""
    height, width = shape
    coarse = np.random.default_rng(seed).normal(size=(int(height / grain_px) + 3, int(width / grain_px) + 3))
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)


def darkened(frame: Frame, to: float = 0.015) -> Frame:
    """The lights are off: less light than noise."""
    return _grainy(frame * to, noise=2.0)


def fogged(frame: Frame, share=0.97) -> Frame:
    """Fog takes a `share` of the picture, a number or (H, W)."""
    share = np.broadcast_to(share, frame.shape[:2])[..., None]
    return _grainy(frame + share * (np.array([200.0, 198.0, 195.0]) - frame))


def on_the_left(frame: Frame, until: float):
    """(H, W): 1 left of a part of the width, 0 right of it, with a soft border."""
    x = np.linspace(0, 1, frame.shape[1])
    return np.broadcast_to(1 / (1 + np.exp((x - until) / 0.01)), frame.shape[:2])


def defocused(frame: Frame, sigma_px: float) -> Frame:
    """The lens lost its focus."""
    return _grainy(cv2.GaussianBlur(frame, (0, 0), sigma_px))


def blinded(frame: Frame) -> Frame:
    """The sun shines into the lens: a white place with a veil around."""
    height, width = frame.shape[:2]
    y, x = np.mgrid[0:height, 0:width]
    away = np.hypot(x - 0.55 * width, y - 0.6 * height) / width
    light = 600 / (1 + np.exp((away - 0.3) / 0.04)) + 150 * np.exp(-away / 0.4)
    return _grainy(np.minimum(frame + light[..., None], 255))


def blocked(frame: Frame, colour, until: float) -> Frame:
    """Something of one colour stands right before the left of the lens."""
    share = on_the_left(frame, until)[..., None]
    shading = 1 + 0.1 * _cloud(frame.shape[:2], frame.shape[1] / 4)[..., None]
    return _grainy(frame + share * (np.array(colour) * shading - frame))


def lettered(frame: Frame, colour, share: float) -> Frame:
    """A sharp board with large letters stands before the middle `share` of the picture, each way."""
    height, width = frame.shape[:2]
    across, down = round(share * width), round(share * height)
    left, top = (width - across) // 2, (height - down) // 2
    board = np.full((down, across, 3), colour, np.uint8)
    cv2.putText(board, "CLOSED", (0, down // 2), cv2.FONT_HERSHEY_DUPLEX, across / 130, (255, 255, 255), 4)
    seen = frame.copy()
    seen[top : top + down, left : left + across] = board
    return seen
