"""Venues as `PUT /venues` takes them, of cameras and fields of the engine."""

from collections.abc import Sequence

from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field


def venue_document(name: str, field: Field, cameras: Sequence[Camera]) -> dict:
    """Return the document of a venue whose cameras are stored as they are given."""
    size = {"length_m": field.length, "width_m": field.width, "line_width_m": field.line_width}
    return {
        "id": name,
        "field": {**size, "ridge": field.ridge.tolist()},
        "cameras": [
            {
                "id": camera.id,
                "image_size": list(camera.intrinsics.size),
                "intrinsics": {
                    "matrix": camera.intrinsics.matrix.tolist(),
                    "distortion": camera.intrinsics.distortion.tolist(),
                },
                "pose": pose_document(camera.pose),
            }
            for camera in cameras
        ],
    }


def pose_document(pose: Pose) -> dict:
    """Return a pose as the service writes it."""
    return {"rotation": pose.rotation.tolist(), "position": pose.position.tolist()}
