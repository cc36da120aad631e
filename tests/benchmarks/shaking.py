"""How still a shaking rig stands when it is followed: `python -m tests.benchmarks.shaking`.

The two cameras of the demo on a mast in wind: each turns by 0.3 degrees at 0.5 Hz about each of its axes, in phases of
its own, trembles by 0.03 degrees at 3 Hz, and sways by 2 cm, as a mast does that bends. Each frame is the demo's picture
as the camera would take it from where it then is: what is on the ground moves as the ground does, what is far away turns
only. Players walk through it, and each frame has noise of its own and a JPEG's losses.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from tests.demo.render import FIELD, HERE, cameras
from worker.calibration.follow.follower import Follower, Moment
from worker.calibration.scene.camera import Array, Camera, Frame, Pose, rotation_angles_deg, rotation_matrices, rotation_vectors
from worker.calibration.scene.motion import change_between, moved
from worker.calibration.stitch.views import View, ViewChoice, chosen_view

SWING_DEG, SWING_HZ = 0.3, 0.5
TREMBLE_DEG, TREMBLE_HZ = 0.03, 3.0
SWAY_M = 0.02
FRAMES_PER_SECOND = 25.0
# Grey levels of a camera's noise, quality of its compression.
NOISE, JPEG_QUALITY = 2.5, 85
PLAYERS, PLAYER_M, PLAYER_M_S = 16, (0.6, 1.85), 3.0
# The map from a shaken frame to the still picture is computed at every n-th pixel.
STEP_PX = 8
FAR_M = 300.0


@dataclass(frozen=True)
class Swing:
    """How one camera shakes: phases (6, 2) of turns and shifts, at both frequencies."""

    phases: Array

    def change(self, seconds: float) -> Array:
        """Of the pose, (6,): turn in the camera's frame (rad), shift in the world (m)."""
        swing, tremble = np.sin(2 * np.pi * seconds * np.array([SWING_HZ, TREMBLE_HZ]) + self.phases).T
        turn = np.radians(SWING_DEG) * swing[:3] + np.radians(TREMBLE_DEG) * tremble[:3]
        sway = SWAY_M * swing[3:] + SWAY_M * TREMBLE_DEG / SWING_DEG * tremble[3:]
        return np.concatenate([turn, sway * [1.0, 1.0, 0.2]])


class Clip:
    """Frames of a shaking camera, and where it really was."""

    def __init__(self, still: Camera, picture: Frame, rng: np.random.Generator) -> None:
        self.still = still
        self._picture = picture
        self._swing = Swing(rng.uniform(0, 2 * np.pi, (6, 2)))
        self._noise = rng.normal(0, NOISE, (picture.shape[0] + 64, picture.shape[1] + 64)).astype(np.float32)
        self._rng = rng
        self._players = rng.uniform([-45, -30], [45, 30], (PLAYERS, 2))
        self._heading = rng.uniform(0, 2 * np.pi, PLAYERS)
        self._shirt = 25 + 200 * rng.integers(0, 2, (PLAYERS, 1)) + rng.integers(0, 30, (PLAYERS, 3))
        width, height = still.intrinsics.size
        x, y = (STEP_PX * (np.arange(-(-extent // STEP_PX) + 2) - 0.5) - 0.5 for extent in (width, height))
        grid = np.stack(np.meshgrid(x, y), axis=-1)
        plane = still.intrinsics.undistort(grid)
        self._rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)

    def camera(self, number: int) -> Camera:
        """Where it is when a frame is taken."""
        return moved(self.still, self._swing.change(number / FRAMES_PER_SECOND))

    def frame(self, number: int) -> Frame:
        """What it shows then."""
        now = self.camera(number)
        behind = self._behind(now)
        source = self.still.project(behind).astype(np.float32)
        fine = cv2.resize(source, None, fx=STEP_PX, fy=STEP_PX, interpolation=cv2.INTER_LINEAR)
        width, height = now.intrinsics.size
        place = fine[STEP_PX : STEP_PX + height, STEP_PX : STEP_PX + width]
        shaken = cv2.remap(self._picture, place, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        self._walk(shaken, now, number)
        down, right = self._rng.integers(0, 64, 2)
        noisy = np.clip(shaken + self._noise[down : down + height, right : right + width, None], 0, 255).astype(np.uint8)
        packed = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)

    def _behind(self, now: Camera) -> Array:
        """What of the world is behind the pixels of the grid: the ground, or what is far away."""
        rays = self._rays @ now.pose.matrix
        height = np.zeros(rays.shape[:2])
        for _ in range(4):
            nearness = np.maximum(-rays[..., 2] / (now.pose.position[2] - height), 1 / FAR_M)
            points = now.pose.position + rays / nearness[..., None]
            height = FIELD.height(points[..., :2])
        return points

    def _walk(self, frame: Frame, now: Camera, number: int) -> None:
        """Players: upright boxes that walk, in shirts dark and white."""
        gone = PLAYER_M_S * number / FRAMES_PER_SECOND
        along = np.stack([np.cos(self._heading), np.sin(self._heading)], axis=1)
        feet = (self._players + gone * along + [50, 32]) % [100, 64] - [50, 32]
        for place, shirt in zip(FIELD.lift(feet), self._shirt, strict=True):
            corners = now.project(place + np.array([[0, 0, 0], [0, 0, PLAYER_M[1]]]))
            if np.isfinite(corners).all():
                (x0, y0), (x1, y1) = corners
                half = PLAYER_M[0] / PLAYER_M[1] * abs(y0 - y1) / 2
                box = np.rint(np.array([[(x0 + x1) / 2 - half, y1], [(x0 + x1) / 2 + half, y0]])).astype(int).tolist()
                cv2.rectangle(frame, box[0], box[1], shirt.tolist(), -1)


def clips(scale: float, seed: int = 19) -> list[Clip]:
    """Those of the demo's cameras, in frames `scale` times as large as 4K."""
    rng = np.random.default_rng(seed)
    made = []
    for camera in cameras():
        lens = camera.intrinsics.scaled(scale)
        picture = np.asarray(cv2.imread(str(HERE / f"{camera.id}.jpg")), np.uint8)
        made.append(Clip(camera.with_lens(lens), cv2.resize(picture, lens.size, interpolation=cv2.INTER_AREA), rng))
    return made
