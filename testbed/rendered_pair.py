"""Two rendered cameras of a pitch whose stored poses are outdated, small enough for the real engine in tests."""

from functools import cache

import cv2
import numpy as np

from models.training.pitches.render import Conditions, render_frame
from testbed.synthetic import moved
from testbed.venue_documents import venue_document
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

SIZE = (960, 540)
PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
MOVED_M = np.array([0.06, -0.05, 0.04])
TURNED = np.array([0.006, -0.005, 0.004])


def cameras() -> list[Camera]:
    lens = Intrinsics(
        np.array([[615.0, 0, 480.5], [0, 615.0, 267.5], [0, 0, 1]]), np.array([-0.3, 0.08, 0, 0, 0]), SIZE
    )
    return [
        Camera("left", lens, Pose.looking_at([-0.9, -48.0, 12.0], [-22.0, -12.0, 0.0])),
        Camera("right", lens, Pose.looking_at([0.8, -48.0, 12.0], [22.0, -12.0, 0.0])),
    ]


@cache
def frames() -> dict[str, bytes]:
    rng = np.random.default_rng(0)
    return {c.id: encoded(render_frame(PITCH, c, Conditions.fair(22), rng).frame) for c in cameras()}


def encoded(frame: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()


def venue(name: str, right_turn=TURNED) -> dict:
    stored = [moved(camera, turn, MOVED_M) for camera, turn in zip(cameras(), (TURNED, right_turn), strict=True)]
    return venue_document(name, PITCH, stored)
