"""A stitched view for OpenCV: a file of NumPy's, and what uses it."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.ground_view import box
from worker.calibration.stitching.panorama import BACKDROP, Panorama
from worker.programs.stitch.scaled import in_scaled, scaled_size

USER = Path(__file__).with_name("with_opencv.py")


def files(made: Panorama) -> dict[str, bytes]:
    """Files by name."""
    arrays: dict[str, NDArray[Any]] = {
        "cameras": np.array([part.camera for part in made.parts]),
        "backdrop": np.where(made.seen, 0, BACKDROP).astype(np.uint8),
    }
    for part in made.parts:
        size = scaled_size(part)
        counts = part.weight > 0
        around = box(counts) if counts.any() else (slice(0, 1), slice(0, 1))
        place = in_scaled(part, size)[around]
        rows, columns = around
        of_camera = {
            "size": np.array(size),
            "corner": np.array([columns.start, rows.start]),
            "x": place[..., 0],
            "y": place[..., 1],
            "weight": part.weight[around],
            "tones": part.light.tones,
            "rise": part.rise[around] if part.light.falloff else np.ones((1, 1), np.float32),
        }
        arrays |= {f"{part.camera}_{name}": values for name, values in of_camera.items()}
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return {"stitch.py": USER.read_bytes(), "maps.npz": buffer.getvalue()}
