"""Random pitches, lenses and camera positions."""

from __future__ import annotations

import numpy as np

from models.training.pitches.world import SIDES
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

SIZES = ((1280, 720), (1920, 1080), (1920, 1080), (2560, 1440), (2688, 1520), (3072, 1728), (3840, 2160), (3840, 2160))


def random_field(rng: np.random.Generator) -> Field:
    """A pitch within Law 1, from flat to a crown of 0.6 m."""
    length, width = float(rng.uniform(90, 120)), float(rng.uniform(45, 90))
    if rng.random() < 0.6:
        length, width = 105.0, 68.0
    crown, half_ridge = float(rng.uniform(0, 0.6)), float(rng.uniform(0, 0.45 * length))
    ridge = np.array([[-half_ridge, 0.0, crown], [half_ridge, 0.0, crown]])
    return Field(length, width, float(rng.uniform(0.09, 0.125)), ridge if rng.random() < 0.8 else None)


def random_intrinsics(rng: np.random.Generator) -> Intrinsics:
    """A lens of 60 to 120 degrees across (now and then a longer one), with the distortion such lenses have."""
    width, height = SIZES[rng.integers(len(SIZES))]
    across = np.radians(rng.uniform(60, 120) if rng.random() < 0.8 else rng.uniform(25, 60))
    k1 = float(rng.uniform(-0.38, -0.2) if rng.random() < 0.6 else rng.uniform(-0.2, 0.03))
    # Above 0.45 k1² the radius grows everywhere, so that every pixel has a ray.
    k2 = k1 * k1 * float(rng.uniform(0.6, 1.1))
    edge = np.tan(across / 2)
    focal = (width / 2) / (edge * (1 + k1 * edge**2 + k2 * edge**4))
    centre = np.array([width, height]) / 2 + rng.normal(0, 0.02, 2) * width
    matrix = np.array([[focal, 0, centre[0]], [0, focal * rng.uniform(0.998, 1.002), centre[1]], [0, 0, 1]])
    tangential = rng.normal(0, 0.0005, 2)
    return Intrinsics(matrix, np.array([k1, k2, *tangential, 0.0]), (width, height))


def random_camera(rng: np.random.Generator, pitch: Field) -> Camera:
    """A camera 5 to 40 m high on any side of the pitch, that looks at a place on it."""
    height = float(np.exp(rng.uniform(np.log(5), np.log(40 if rng.random() < 0.5 else 15))))
    behind = float(rng.uniform(1, 12) if rng.random() < 0.5 else rng.uniform(5, 45))
    along = float(np.clip(rng.normal(0, 0.25), -0.6, 0.6))
    side = rng.choice(SIDES, p=[0.35, 0.25, 0.2, 0.2])
    sign = -1.0 if side in ("near", "left") else 1.0
    if side in ("near", "far"):
        position = np.array([along * pitch.length, sign * (pitch.width / 2 + behind), height])
    else:
        position = np.array([sign * (pitch.length / 2 + behind), along * pitch.width, height])
    target = np.array([rng.uniform(-0.5, 0.5) * pitch.length, rng.uniform(-0.5, 0.5) * pitch.width, 0.0])
    pose = Pose.looking_at(position, target, roll_deg=float(rng.normal(0, 3)))
    return Camera("camera", random_intrinsics(rng), pose)
