"""Nights of one camera before a painted field, measured without pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from testbed.simulated_nights import SHARED_PX, Installation, Painted, SimulatedSight
from testbed.synthetic import TAPED, camera
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.memory.camera_memory import AcceptedJob

PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]]), sigma=TAPED)
LINES = PITCH.line_points()


def box_camera() -> Camera:
    """One that looks at a penalty area from 50 m."""
    return camera("box", (40.0, -45.0, 16.0), (44.0, 0.0), 4000.0, (-0.08, 0.006, 0, 0, 0), (3840, 2160))


def painted(seed: int = 0) -> Painted:
    return Painted.drawn(PITCH, np.random.default_rng(seed))


def measured(camera: Camera, field: Painted, seed: int = 1, noise_px: float = 0.2) -> Measurements:
    """What a real camera measures of a painted field, beside where it expects the plan."""
    noise = noise_px * np.random.default_rng(seed).normal(size=(1, len(LINES)))
    return SimulatedSight(field, [camera], noise).measure(LINES, [camera], 30.0)[0]


def job(camera: Camera, its: Measurements, number: int = 0, **other) -> AcceptedJob:
    return AcceptedJob(camera, its, LINES, None, frames=str(number), **other)


def nights_of(longer: Callable[[int], float], count: int, seed: int = 0) -> list[tuple[CameraResult, Camera]]:
    """The answers of some nights with the real camera of each, whose focal length is longer by a part of it."""
    rng = np.random.default_rng(seed)
    camera, field = box_camera(), painted(seed)
    shared = SHARED_PX * rng.normal(size=(1, len(LINES)))
    venue = Installation(PITCH, [replace(camera)])
    done = []
    for night in range(count):
        real = with_focal_length(camera, longer(night) * camera.intrinsics.focal_length_px)
        (result,) = venue.night(SimulatedSight.of_night(field, [real], shared, rng))
        done.append((result, real))
    return done
