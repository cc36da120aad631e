"""From four displaced points to a pose: a homography becomes one by K."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.learned.window import QUAD, Picture, Window
from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field

Displacement = Callable[[Picture, Picture], Array]
"""From a mask of the window and the template to how far the points of `QUAD` have to move, (4, 2) pixels."""


def corrected(camera: Camera, pitch: Field, response: NDArray[np.float32], find: Displacement) -> Camera:
    """The camera as its segmentation (H, W) in 0..1 says that it stands, by one of the methods."""
    window = Window.of(camera.pose)
    return with_displaced(camera, pitch, find(window.seen(response, camera, pitch), window.template(pitch)))


def with_displaced(camera: Camera, pitch: Field, offsets: Array) -> Camera:
    """The camera in the pose that puts its pixels of the four points `offsets` (4, 2) farther on the ground.

    The four points lie on the roof before and after, so that true displacements give the true pose, crown or none.
    """
    window = Window.of(camera.pose)
    pixels = camera.project(pitch.lift(window.ground(QUAD)))
    return posed_by(camera, pitch.lift(window.ground(QUAD + offsets)), pixels)


def posed_by(camera: Camera, points: Array, pixels: Array) -> Camera:
    """The camera where OpenCV puts it, from its own pose on: it sees world points (N, 3) in its pixels (N, 2)."""
    lens = camera.intrinsics
    _, turn, move = cv2.solvePnP(
        points,
        pixels,
        lens.matrix,
        lens.distortion,
        camera.pose.rotation.copy(),
        camera.pose.translation.copy(),
        useExtrinsicGuess=True,
    )
    return camera.with_pose(Pose.from_translation(turn.ravel(), move.ravel()))
