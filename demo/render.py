"""Makes the demo venue: `python -m demo.render` writes venue.json, truth.json, left.jpg and right.jpg here.

Two cameras on one pole near the halfway line. The venue stores the poses of before a storm; truth.json has those of the
frames.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from models.training.pitches.render import Conditions, render_frame
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors

HERE = Path(__file__).parent
SIZE = (3840, 2160)
WORLD = 56
MOVED_M, MOVED_DEG = 0.16, 1.0
LARGEST_BYTES = 3_000_000
# What a good board leaves, which a lens without a sigma is taken to be as sure as.
LENS_SIGMA = {"fx": 0.7, "fy": 0.7, "cx": 1.0, "cy": 1.0, "k1": 0.0005, "k2": 0.0005}
FIELD_SIGMA = {"length_m": 0.03, "width_m": 0.02}

FIELD = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))


def cameras() -> list[Camera]:
    """The two cameras as they stand when the frames are taken."""
    left = Intrinsics(
        np.array([[2330.0, 0, 1931.5], [0, 2330.0, 1068.2], [0, 0, 1]]), np.array([-0.302, 0.083, 0, 0, 0]), SIZE
    )
    right = Intrinsics(
        np.array([[2322.0, 0, 1908.3], [0, 2322.0, 1087.9], [0, 0, 1]]), np.array([-0.299, 0.081, 0, 0, 0]), SIZE
    )
    return [
        Camera("left", left, Pose.looking_at([-0.9, -48.0, 12.1], [-26.0, -19.5, 0], roll_deg=-1.2)),
        Camera("right", right, Pose.looking_at([0.8, -48.1, 12.0], [25.6, -19.0, 0], roll_deg=0.9)),
    ]


def conditions() -> Conditions:
    """A sunny afternoon."""
    return replace(Conditions.fair(WORLD), wear=0.04)


def outdated(pose: Pose, shift_m: float, turn_deg: float, rng: np.random.Generator) -> Pose:
    """The pose of before: so far off, in random directions."""
    shift, turn = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    turned = rotation_matrices(np.radians(turn_deg) * turn) @ pose.matrix
    return Pose(rotation_vectors(turned), pose.position + shift_m * shift)


def main() -> None:
    """Render the frames and write the venue."""
    rng = np.random.default_rng(2026)
    entries, truth = [], {}
    for camera in cameras():
        rendering = render_frame(FIELD, camera, conditions(), rng)
        for quality in range(92, 40, -3):
            _, packed = cv2.imencode(".jpg", rendering.frame, [cv2.IMWRITE_JPEG_QUALITY, quality])
            if len(packed) <= LARGEST_BYTES:
                break
        (HERE / f"{camera.id}.jpg").write_bytes(packed.tobytes())
        truth[camera.id] = _written(camera.pose)
        entries.append(
            {
                "id": camera.id,
                "image_size": list(SIZE),
                "intrinsics": {
                    "matrix": camera.intrinsics.matrix.tolist(),
                    "distortion": camera.intrinsics.distortion.tolist(),
                    "sigma": LENS_SIGMA,
                },
                "pose": _written(outdated(camera.pose, MOVED_M, MOVED_DEG, rng)),
            }
        )
    shape = {"length_m": FIELD.length, "width_m": FIELD.width, "line_width_m": FIELD.line_width}
    venue = {
        "id": "demo",
        "name": "Demo pitch (rendered)",
        "field": {"template": "football", **shape, "ridge": FIELD.ridge.tolist(), "sigma": FIELD_SIGMA},
        "cameras": entries,
    }
    (HERE / "venue.json").write_text(json.dumps(venue, indent=1) + "\n")
    (HERE / "truth.json").write_text(json.dumps({"poses": truth}, indent=1) + "\n")


def _written(pose: Pose) -> dict[str, list[float]]:
    return {"rotation": np.round(pose.rotation, 8).tolist(), "position": np.round(pose.position, 6).tolist()}


if __name__ == "__main__":
    main()
