"""Cameras that formats are tried with, and what OpenCV says they see."""

import cv2
import numpy as np

from service.formats.lens import NumberedCamera
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.venue import Camera

SIZE = (3072, 1728)
RADIAL = [-0.3402, 0.1042, 0.0, 0.0, -0.012]
ALL_OF_OPENCV_8 = [0.12, -0.03, 0.0011, -0.0007, 0.004, 0.41, -0.02, 0.006]
WITH_THIN_PRISM = [*ALL_OF_OPENCV_8, 0.0012, -0.0003, 0.0007, 0.0002]
WITH_TILT = [*WITH_THIN_PRISM, 0.01, -0.02]


def shot(distortion=(), *, rotation=(1.67922206, 0.40966611, -0.47792389), number=1, focal=(2122.4, 2122.4), skew=0.0):
    """A camera beside a pitch; square pixels and a principal point off the middle, unless said."""
    camera = Camera(
        id=f"camera-{number}",
        image_size=list(SIZE),
        intrinsics=Intrinsics(
            matrix=[[focal[0], skew, 1634.8], [0, focal[1], 877.7], [0, 0, 1]], distortion=list(distortion)
        ),
        pose=Pose.from_position(list(rotation), [-1.611377, -49.405109, 7.886158]),
    )
    return NumberedCamera(camera, number)


def seen_points(shot, count=1000):
    """World points (count, 3) in the picture of a camera and their pixels (count, 2), by OpenCV."""
    camera = shot.camera
    k, distortion = np.array(camera.intrinsics.matrix), np.array(camera.intrinsics.distortion, dtype=float)
    rng = np.random.default_rng(5)
    rays = rng.uniform([-0.65, -0.38], [0.6, 0.36], size=(count, 2))
    rotation, _ = cv2.Rodrigues(np.array(camera.pose.rotation))
    in_camera = np.concatenate([rays, np.ones((count, 1))], axis=1) * rng.uniform(5, 90, size=(count, 1))
    world = in_camera @ rotation + camera.pose.position
    rvec, tvec = (np.array(v, dtype=float) for v in (camera.pose.rotation, camera.pose.translation))
    pixels, _ = cv2.projectPoints(world, rvec, tvec, k, distortion if len(distortion) else None)
    return world, pixels[:, 0]


def farthest(pixels, others):
    """The largest distance between pixels (N, 2)."""
    assert pixels.shape == others.shape
    return np.linalg.norm(pixels - others, axis=1).max()
