"""Cameras proposed for a stand: which way each of them looks, and how wide, so that together they see the field."""

from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.planning.plan import field_cells


@dataclass(frozen=True)
class Stand:
    """Place of a mast, (3,) m, for a number of `cameras` whose pictures of `size` overlap by `overlap_deg`."""

    name: str
    position: Array
    cameras: int
    size: tuple[int, int]
    overlap_deg: float


def propose_cameras(pitch: Field, stand: Stand) -> list[Camera]:
    """Return cameras of one lens that share the field's width in angle, seen from the stand; from left to right."""
    towards = pitch.lift(field_cells(pitch)).reshape(-1, 3) - stand.position
    # Angles to the right of the middle of the field, and up.
    ahead = np.arctan2(-stand.position[0], -stand.position[1])
    pan = np.degrees(np.arctan2(towards[:, 0], towards[:, 1]) - ahead)
    pan = (pan + 180) % 360 - 180
    span = float(np.ptp(pan))
    wide = min((span + (stand.cameras - 1) * stand.overlap_deg) / stand.cameras, 120.0)
    first = pan.min() + wide / 2
    pans = [float(first + number * (wide - stand.overlap_deg)) for number in range(stand.cameras)]
    lens = pinhole(stand.size, wide)
    high = 2 * np.degrees(np.arctan(stand.size[1] / 2 / lens.focal_length_px))
    up = np.degrees(np.arctan2(towards[:, 2], np.linalg.norm(towards[:, :2], axis=1)))
    return [
        Camera(
            f"{stand.name}-{number}",
            lens,
            pose_by_angles(
                stand.position, at + np.degrees(ahead), _tilt(up[np.abs(pan - at) <= wide / 2], float(high))
            ),
        )
        for number, at in enumerate(pans, 1)
    ]


def _tilt(up: Array, high: float) -> float:
    """Return the tilt that has angles `up` (N,) in the middle of a picture so `high`, the far end of them in any case;
    all in degrees."""
    margin = 0.03 * high
    return float(max((up.min() + up.max()) / 2, up.max() + margin - high / 2))


def pinhole(size: tuple[int, int], wide_deg: float) -> Intrinsics:
    """Return a lens without distortion that sees a horizontal angle, its axis in the middle of the picture."""
    width, height = size
    focal = width / 2 / np.tan(np.radians(wide_deg) / 2)
    matrix = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
    return Intrinsics(matrix, np.zeros(5), size)


def pose_by_angles(position: Array, pan_deg: float, tilt_deg: float, roll_deg: float = 0.0) -> Pose:
    """Return the pose that looks along y at pan 0, to the right of it at a positive pan, upwards at a positive tilt,
    and is rolled clockwise seen from behind."""
    pan, tilt = np.radians([pan_deg, tilt_deg])
    ahead = np.array([np.sin(pan) * np.cos(tilt), np.cos(pan) * np.cos(tilt), np.sin(tilt)])
    return Pose.looking_at(position, np.asarray(position) + ahead, -roll_deg)


def pan_tilt_deg(pose: Pose) -> tuple[float, float]:
    """Return pan and tilt of a pose, degrees, as `pose_by_angles` takes them."""
    x, y, z = pose.matrix[2].tolist()
    return float(np.degrees(np.arctan2(x, y))), float(np.degrees(np.arcsin(np.clip(z, -1, 1))))


def field_of_view_deg(camera: Camera) -> float:
    """Return the horizontal angle that a camera sees in the middle row of its picture, degrees."""
    width, height = camera.intrinsics.size
    middle = (height - 1) / 2
    left, right = camera.intrinsics.directions(np.array([[-0.5, middle], [width - 0.5, middle]]))
    return float(np.degrees(np.arctan2(right[0], right[2]) - np.arctan2(left[0], left[2])))
