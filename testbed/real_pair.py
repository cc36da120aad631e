"""A real pair of cameras, kept beside the repository: people in its pictures can be recognised."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from models.training.evaluate import real_cameras
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field

FOLDER = Path(__file__).parents[2] / "shared" / "real" / "tsukuba"


@cache
def picture(path: Path) -> np.ndarray:
    """A frame, read once for all tests."""
    frame = cv2.imread(str(path), cv2.IMREAD_COLOR)
    frame.flags.writeable = False
    return frame


@dataclass(frozen=True)
class RealPair:
    """The venue, its files, and what is known of it."""

    pitch: Field
    cameras: list[Camera]
    venue: dict
    starts: dict
    clicks: dict

    @classmethod
    def load(cls) -> "RealPair":
        pitch, cameras = real_cameras(FOLDER)
        venue, starts, clicks = (
            json.loads((FOLDER / name).read_text()) for name in ("venue.json", "starts.json", "keypoints.json")
        )
        return cls(pitch, list(cameras.values()), venue, starts, clicks)

    def files(self, moment: str = "000") -> dict[str, Path]:
        return {camera.id: FOLDER / f"{camera.id}_{moment}.jpg" for camera in self.cameras}

    def frames(self, moment: str = "000") -> dict[str, tuple[np.ndarray]]:
        return {name: (picture(path),) for name, path in self.files(moment).items()}

    def started(self, kind: str, number: int) -> list[Camera]:
        """The cameras at one of the outdated poses."""
        stored = self.starts[kind][number]
        return [
            c.with_pose(Pose(np.array(stored[c.id]["rotation"]), np.array(stored[c.id]["position"])))
            for c in self.cameras
        ]

    def clicked_rms(self, camera_id: str, pose: Pose) -> float:
        """Rms (px) of the hand-clicked pitch points."""
        return self.clicked_rms_of(next(c for c in self.cameras if c.id == camera_id).with_pose(pose))

    def clicked_rms_of(self, camera: Camera) -> float:
        """Rms (px) of the hand-clicked pitch points for a camera with a lens of its own."""
        world = np.array([click["world"] for click in self.clicks[camera.id]], dtype=float)
        pixel = np.array([click["pixel"] for click in self.clicks[camera.id]])
        off = camera.project(self.pitch.lift(world)) - pixel
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
