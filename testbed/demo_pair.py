"""The demo's two cameras with small frames, for tests of the real engine: nothing has to be rendered for them."""

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

import demo
from service.schemas.venue import VenueIn
from testbed.rendered_pair import MOVED_M, PITCH, SIZE, TURNED, encoded
from testbed.synthetic import moved
from testbed.venue_documents import venue_document
from worker.calibration.geometry.camera import Camera, Pose
from worker.jobs.from_schemas import camera_of

DEMO = Path(demo.__file__).parent


@cache
def cameras() -> list[Camera]:
    """The cameras as they really stand."""
    stored = VenueIn.model_validate_json((DEMO / "venue.json").read_text()).to_venue().cameras
    poses = json.loads((DEMO / "truth.json").read_text())["poses"]
    true = [Pose(*(np.array(poses[one.id][part]) for part in ("rotation", "position"))) for one in stored]
    return [camera_of(one).with_pose(pose).resized(SIZE[0]) for one, pose in zip(stored, true, strict=True)]


@cache
def frames() -> dict[str, bytes]:
    return {c.id: encoded(picture(c.id)) for c in cameras()}


def picture(camera: str) -> np.ndarray:
    """The frame (H, W, 3) of a camera."""
    return cv2.imread(str(DEMO / f"{camera}.jpg"), cv2.IMREAD_REDUCED_COLOR_4)


def venue(name: str) -> dict:
    """Its stored poses are outdated."""
    return venue_document(name, PITCH, [moved(camera, TURNED, MOVED_M) for camera in cameras()])
