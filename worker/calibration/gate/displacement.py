"""Displacement of a camera from its anchor, as metres on the ground where an error of its pose counts most.

The anchor is the pose from which movement is counted over months. Degrees and metres of a pose hide what matters: if a
camera 60 m from the far touchline turns by 0.01 degrees to the side, it puts that line a centimetre off; if it stands 8
m high and tilts by the same angle, eight centimetres.
"""

from dataclasses import dataclass

import numpy as np

from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import ground_jacobian
from worker.calibration.geometry.far_marking import on_the_ground
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length


@dataclass(frozen=True)
class RelativeFocalLength:
    """Relative change of a focal length: `value` is the part by which it is longer, `sigma` one standard deviation."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Displacement:
    """Displacement of the farthest `place` (3,) of the ground in view of the anchor, by a camera's new pose.

    `shift` (2,), m: across the line of sight (to the right in the picture) and along it (away from the camera). `sigma`
    (2,), m: one standard deviation of it by the pose's covariance; `repeatability` (2,), m: the part of that in which
    lens and field, the same every night, have no part. `focal`: the focal length that the lines speak for relative to
    the anchor's, None where it is unknown; `focal_shift_m`: the move of `place` for a focal length that is longer by
    all of it, to first order.
    """

    place: Array
    shift: Array
    sigma: Array
    repeatability: Array
    focal: RelativeFocalLength | None
    focal_shift_m: float


def measure_displacement(pitch: Field, anchor: Camera, found: CameraResult) -> Displacement | None:
    """Compare an answered pose with the anchor; None without a covariance, or where no ray meets the ground again."""
    place = farthest_place(pitch, anchor)
    if place is None or found.covariance is None:
        return None
    axes = sight_axes(anchor, place)
    moved = ground_point(found.camera, anchor.project(place), place[2])
    jacobian = axes @ ground_jacobian(anchor, place)
    with np.errstate(invalid="ignore"):
        sigma = np.sqrt(np.diag(jacobian @ found.covariance @ jacobian.T))
    if not (np.isfinite(moved).all() and np.isfinite(sigma).all()):
        return None
    return Displacement(
        place,
        axes @ (moved - place)[:2],
        sigma,
        sigma * repeatable_share(found),
        relative_focal_length(anchor, found),
        _focal_shift_m(anchor, place),
    )


def farthest_place(pitch: Field, camera: Camera) -> Array | None:
    """Return the point (3,) of the markings in view that is farthest along the ground, m; None without any."""
    lines = pitch.line_points().position
    seen = lines[camera.sees(camera.project(lines))]
    if len(seen) == 0:
        return None
    away = np.linalg.norm(seen[:, :2] - camera.pose.position[:2], axis=1)
    farthest: Array = seen[np.argmax(away)]
    return farthest


def sight_axes(camera: Camera, place: Array) -> Array:
    """Return unit vectors (2, 2) on the ground at `place`: across the line of sight (right), and along it (away)."""
    away = (place - camera.pose.position)[:2]
    away = away / np.linalg.norm(away)
    return np.array([[away[1], -away[0]], away])


def ground_point(camera: Camera, pixel: Array, height: float) -> Array:
    """Return the point (3,), m, where the ray through a pixel (2,) meets the plane of a height; NaN if nowhere."""
    return np.append(on_the_ground(camera, pixel[None], np.array([height]))[0], height)


def repeatable_share(found: CameraResult) -> float:
    """Return the part 0..1 of a pose's sigma that another night's frames would draw anew, the larger of turn and place.

    The engine states repeatability as two numbers, and not by direction on the ground.
    """
    if found.sigma is None or found.repeatability is None:
        return 1.0
    whole, part = found.sigma, found.repeatability
    shares = (part.rotation_deg / whole.rotation_deg, part.position_m / whole.position_m)
    return float(np.clip(max(shares), 0.0, 1.0))


def relative_focal_length(anchor: Camera, found: CameraResult) -> RelativeFocalLength | None:
    """Return the focal length that tonight's lines speak for relative to the anchor's; None without an estimate."""
    if found.zoom is None:
        return None
    before = anchor.intrinsics.focal_length_px
    tonight = found.camera.intrinsics.focal_length_px
    if not found.lens_found:
        # The estimate relative to the lens taken for known; a lens that was found has it already.
        tonight += found.zoom.value
    return RelativeFocalLength(tonight / before - 1, found.zoom.sigma / before)


def _focal_shift_m(camera: Camera, place: Array) -> float:
    focal_step = 1e-4
    longer = with_focal_length(camera, focal_step * camera.intrinsics.focal_length_px)
    shifted = ground_point(longer, camera.project(place), place[2])
    shift_m = float(np.linalg.norm(shifted - place)) / focal_step
    return shift_m if np.isfinite(shift_m) else 0.0
