"""The demo's two cameras with small frames, for the real engine in tests, whose stored poses are outdated."""

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

import demo
from testbed.synthetic import moved
from testbed.venue_documents import venue_document
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

DEMO = Path(demo.__file__).parent
SIZE = (960, 540)
PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
MOVED_M = np.array([0.06, -0.05, 0.04])
TURNED = np.array([0.006, -0.005, 0.004])


@cache
def cameras() -> list[Camera]:
    """The cameras as they really stand."""
    poses = json.loads((DEMO / "truth.json").read_text())["poses"]
    standing = []
    for camera in json.loads((DEMO / "venue.json").read_text())["cameras"]:
        matrix, distortion = (np.array(camera["intrinsics"][name]) for name in ("matrix", "distortion"))
        pose = Pose(*(np.array(poses[camera["id"]][name]) for name in ("rotation", "position")))
        standing.append(Camera(camera["id"], Intrinsics(matrix, distortion, tuple(camera["image_size"])), pose))
    return [camera.resized(SIZE[0]) for camera in standing]


@cache
def frames() -> dict[str, bytes]:
    return {c.id: encoded(picture(c.id)) for c in cameras()}


def picture(camera: str) -> np.ndarray:
    """The frame (H, W, 3) of a camera."""
    return cv2.imread(str(DEMO / f"{camera}.jpg"), cv2.IMREAD_REDUCED_COLOR_4)


def encoded(frame: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()


def venue(name: str, right_turn=TURNED) -> dict:
    stored = [moved(camera, turn, MOVED_M) for camera, turn in zip(cameras(), (TURNED, right_turn), strict=True)]
    return venue_document(name, PITCH, stored)
