"""A real pair of cameras, kept beside the repository: people in its pictures can be recognised."""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from worker.calibration.camera import Camera, Intrinsics, Pose
from worker.calibration.field import Field

FOLDER = Path(__file__).parents[3] / "shared" / "real" / "tsukuba"


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
        venue = json.loads((FOLDER / "venue.json").read_text())
        field = venue["field"]
        cameras = [
            Camera(
                c["id"],
                Intrinsics(
                    np.array(c["intrinsics"]["matrix"], dtype=float),
                    np.array(c["intrinsics"]["distortion"], dtype=float),
                    tuple(c["image_size"]),
                ),
                Pose(np.array(c["pose"]["rotation"]), np.array(c["pose"]["position"])),
            )
            for c in venue["cameras"]
        ]
        return cls(
            Field(field["length_m"], field["width_m"], field["line_width_m"], np.array(field["ridge"])),
            cameras,
            venue,
            json.loads((FOLDER / "starts.json").read_text()),
            json.loads((FOLDER / "keypoints.json").read_text()),
        )

    def files(self, moment: str = "000") -> dict[str, Path]:
        return {camera.id: FOLDER / f"{camera.id}_{moment}.jpg" for camera in self.cameras}

    def frames(self, moment: str = "000") -> dict[str, tuple[np.ndarray]]:
        return {name: (cv2.imread(str(path), cv2.IMREAD_COLOR),) for name, path in self.files(moment).items()}

    def started(self, kind: str, number: int) -> list[Camera]:
        """The cameras at one of the outdated poses."""
        stored = self.starts[kind][number]
        return [
            c.with_pose(Pose(np.array(stored[c.id]["rotation"]), np.array(stored[c.id]["position"])))
            for c in self.cameras
        ]

    def clicked_rms(self, camera_id: str, pose: Pose) -> float:
        """Rms (px) of the hand-clicked pitch points."""
        camera = next(c for c in self.cameras if c.id == camera_id).with_pose(pose)
        world = np.array([click["world"] for click in self.clicks[camera_id]], dtype=float)
        pixel = np.array([click["pixel"] for click in self.clicks[camera_id]])
        off = camera.project(self.pitch.lift(world)) - pixel
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
