"""The venues whose jobs are measured: the demo, and one to sixteen 4K cameras around a pitch, rendered once."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.scenes import SIZE, START_DEG, START_M, rendered
from demo.render import outdated
from models.training.pitches.conditions import Conditions
from testbed.synthetic import TAPED
from testbed.venue_documents import pose_document, venue_document
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

DEMO = Path(__file__).parents[2] / "demo"
# How far off the stored poses are, metres and degrees: those of a quarter of an hour ago, and the paper's Start.
STARTS = {"near": (0.005, 0.02), "start": (START_M, START_DEG)}
DEMO_CAMERAS = "demo"
PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]]), sigma=TAPED)
# Along the pitch (m), in the order in which cameras are added, on the near side and then on the far one.
PLACES = [(x, side) for few in ((13.0, -13.0, 38.0, -38.0), (25.5, -25.5, 4.5, -4.5)) for side in (-1, 1) for x in few]
SEED = 7


@dataclass(frozen=True)
class Case:
    """A venue as `PUT /venues` takes it, and a file per camera."""

    name: str
    venue: dict
    files: dict[str, bytes]


def case(cameras: str, start: str) -> Case:
    """The demo (`demo`), or the first so many of the sixteen cameras, with stored poses so far off."""
    return _demo(start) if cameras == DEMO_CAMERAS else _around(int(cameras), start)


def _demo(start: str) -> Case:
    venue, truth = (json.loads((DEMO / name).read_text()) for name in ("venue.json", "truth.json"))
    name = f"demo-{start}"
    # Releases before 0.3.0 do not know it.
    del venue["field"]["sigma"]
    for number, camera in enumerate(venue["cameras"]):
        camera["pose"] = pose_document(_stored(_pose(truth["poses"][camera["id"]]), start, number))
    files = {camera["id"]: (DEMO / f"{camera['id']}.jpg").read_bytes() for camera in venue["cameras"]}
    return Case(name, venue | {"id": name}, files)


def _around(count: int, start: str) -> Case:
    name = f"around-{count}-{start}"
    cameras = [_camera(*place) for place in PLACES[:count]]
    conditions = replace(Conditions.fair(11), wear=0.04, blur=0.2, noise=0.2)
    files = {}
    for camera in cameras:
        frame = rendered(f"cost-{camera.id}", PITCH, camera, conditions)
        files[camera.id] = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes()
    stored = [camera.with_pose(_stored(camera.pose, start, number)) for number, camera in enumerate(cameras)]
    return Case(name, venue_document(name, PITCH, stored), files)


def _camera(x: float, side: int) -> Camera:
    matrix = np.array([[2250.0, 0, (SIZE[0] - 1) / 2], [0, 2250.0, (SIZE[1] - 1) / 2], [0, 0, 1]])
    pose = Pose.looking_at([x, side * 48.0, 12.0], [1.3 * x, side * 14.0, 0.0])
    lens = Intrinsics(matrix, np.array([-0.3, 0.083, 0, 0, 0]), SIZE)
    return Camera(f"{'near' if side < 0 else 'far'}-{x + 50:.0f}", lens, pose)


def _stored(truth: Pose, start: str, number: int) -> Pose:
    return outdated(truth, *STARTS[start], np.random.default_rng([SEED, number]))


def _pose(written: dict) -> Pose:
    return Pose(np.array(written["rotation"]), np.array(written["position"]))
