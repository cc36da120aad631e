"""Stitches a picture of each camera, in the order of view.json: python stitch.py left.jpg right.jpg panorama.png"""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np


def stitched(maps: Mapping[str, Any], frames: Iterable[Any]) -> Any:
    """The view (height, width, 3) of a frame of each camera; `maps`: what maps.npz holds."""
    total = np.dstack([maps["backdrop"]] * 3).astype(np.float32)
    for camera, frame in zip(maps["cameras"], frames, strict=True):
        x, y, tones, weight, rise = (maps[f"{camera}_{name}"] for name in ("x", "y", "tones", "weight", "rise"))
        scaled = cv2.resize(frame, maps[f"{camera}_size"].tolist(), interpolation=cv2.INTER_AREA)
        seen = cv2.remap(scaled, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        (left, top), (height, width) = maps[f"{camera}_corner"], weight.shape
        total[top : top + height, left : left + width] += (weight * rise)[..., None] * cv2.LUT(seen, tones[:, None])
    return np.clip(np.rint(total), 0, 255).astype(np.uint8)


if __name__ == "__main__":
    *files, output = sys.argv[1:]
    maps = dict(np.load(Path(__file__).with_name("maps.npz")))
    cv2.imwrite(output, stitched(maps, [cv2.imread(file) for file in files]))
