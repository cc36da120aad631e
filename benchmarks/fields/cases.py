"""Real frames with known cameras, kept beside the repository: people can be recognised in them."""

from __future__ import annotations

import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from service.schemas.field import FieldOfPlay
from worker.calibration.geometry.camera import Camera, Frame, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.jobs.from_schemas import pitch_of

FOLDER = Path(__file__).parents[3] / "shared" / "real" / "fields"


@dataclass(frozen=True)
class Case:
    """A frame, the field in it and its camera at the reference pose.

    `world` (n, 3) m and `pixel` (n, 2): places measured in the frame.
    `unsure`: markings that nobody knows the place of. `venue`: shared by cameras whose frames are of one moment.
    """

    name: str
    source: str
    venue: str
    image: Path
    pitch: Field
    camera: Camera
    world: np.ndarray
    pixel: np.ndarray
    tolerance_px: float
    unsure: frozenset[str]

    def frame(self) -> Frame:
        """The picture."""
        return np.asarray(cv2.imread(str(self.image), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION), np.uint8)

    @property
    def reference_px(self) -> float:
        """Rms distance of the measured places from where the reference pose puts them."""
        return self.rms_px(self.camera)

    def rms_px(self, camera: Camera) -> float:
        """Rms distance of the measured places from where a camera puts them; infinite if it does not see all."""
        off = camera.project(self.world) - self.pixel
        return float(np.sqrt((off**2).sum(axis=1).mean())) if np.isfinite(off).all() else float("inf")


def cases(folder: Path, chosen: Sequence[str] | None) -> list[Case]:
    """Return the cases with a camera, and with one of `chosen` in their names."""
    entries = json.loads((folder / "cases.json").read_text())
    return [
        _case(folder, entry)
        for entry in entries
        if "camera" in entry and (not chosen or any(part in entry["name"] for part in chosen))
    ]


def _case(folder: Path, entry: dict) -> Case:
    lens = entry["camera"]["intrinsics"]
    matrix, distortion = np.array(lens["matrix"], float), np.ravel(np.array(lens["distortion"], float))
    intrinsics = LENSES[lens.get("model", "opencv")](matrix, distortion, tuple(entry["camera"]["image_size"]))
    pose = entry["camera"]["pose"]
    camera = Camera(entry["name"], intrinsics, Pose(np.array(pose["rotation"]), np.array(pose["position"])))
    world, pixel = (np.array([point[key] for point in entry["points"]], float) for key in ("world", "pixel"))
    return Case(
        entry["name"],
        entry["source"],
        entry["rig"] if entry.get("rig") and entry.get("same_instant") else entry["name"],
        folder / entry["image"],
        pitch_of(FieldOfPlay.model_validate(entry["field"])),
        camera,
        world,
        pixel,
        entry["tolerance_px"],
        frozenset(entry.get("unsure", ())),
    )


def started(cameras: Sequence[Camera], name: str, number: int, turn_deg: float, shift_m: float) -> list[Camera]:
    """Cameras turned about random axes and moved in random directions, the same for the same name and number."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), number])
    return [camera.with_pose(_off(camera.pose, turn_deg, shift_m, rng)) for camera in cameras]


def _off(pose: Pose, turn_deg: float, shift_m: float, rng: np.random.Generator) -> Pose:
    axis, way = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
    turned = rotation_matrices(np.radians(turn_deg) * axis) @ pose.matrix
    return Pose(rotation_vectors(turned), pose.position + shift_m * way)
