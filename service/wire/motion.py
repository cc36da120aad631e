"""How far a camera moved: degrees, metres, and pixels of the pitch in its picture.

For history and alarms, which the service writes itself: `quality.Movement` of the engine, on fewer points and a flat
pitch, without arrays. Lenses: OpenCV's calib3d, "Detailed Description", and its fisheye module.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from fields.shapes import Arc, Line, Point, Shape
from service.wire.field import FieldOfPlay
from service.wire.geometry import Intrinsics, Moved, PosedCamera, rotated

# Of all markings together; as many more as there are markings.
POINTS = 150
# How far from the axis a lens is looked at (tangent), and how finely, to find where its formula turns back.
WIDEST, STEP = 6.0, 0.02


def moved(field: FieldOfPlay, before: PosedCamera, after: PosedCamera) -> Moved:
    """From one state of a camera to another. `pixels`: None where no marking was in view, or sizes differ."""
    return Moved(
        rotation_deg=_turned_deg(before.pose.rotation, after.pose.rotation),
        position_m=math.dist(before.pose.position, after.pose.position),
        pixels=_shift_px(field, before, after) if before.image_size == after.image_size else None,
    )


def _turned_deg(before: Sequence[float], after: Sequence[float]) -> float:
    """The angle between two rotations, by their quaternions."""
    (a, u), (b, v) = _quaternion(before), _quaternion(after)
    same = a * b + sum(x * y for x, y in zip(u, v, strict=True))
    across = [a * y - b * x + w for x, y, w in zip(u, v, _cross(v, u), strict=True)]
    # From the sine: the cosine of a small angle says nothing about it.
    return math.degrees(2 * math.atan2(math.hypot(*across), abs(same)))


def _quaternion(rotation: Sequence[float]) -> tuple[float, list[float]]:
    angle = math.hypot(*rotation)
    share = math.sin(angle / 2) / angle if angle else 0.5
    return math.cos(angle / 2), [share * component for component in rotation]


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _shift_px(field: FieldOfPlay, before: PosedCamera, after: PosedCamera) -> float | None:
    """The mean over the markings that were in view."""
    width, height = before.image_size
    was, now = _Projection(before), _Projection(after)
    shifts = []
    for point in _points(field):
        old = was.pixel(point)
        if old is None or not (0 <= old[0] <= width - 1 and 0 <= old[1] <= height - 1):
            continue
        new = now.pixel(point)
        if new is not None:
            shifts.append(math.dist(old, new))
    return sum(shifts) / len(shifts) if shifts else None


def _points(field: FieldOfPlay) -> list[Point]:
    shapes = field.plan.markings(field.size)
    spacing = sum(map(_length, shapes)) / POINTS
    return [point for shape in shapes for point in _along(shape, spacing)]


def _length(shape: Shape) -> float:
    match shape:
        case Line():
            return sum(math.dist(*piece) for piece in pairwise(shape.points))
        case Arc():
            return shape.radius * (shape.end - shape.start)
        case _:
            return 0.0


def _along(shape: Shape, spacing: float) -> Iterator[Point]:
    match shape:
        case Line():
            for start, end in pairwise(shape.points):
                for share in _shares(math.dist(start, end), spacing):
                    yield start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
        case Arc():
            for share in _shares(_length(shape), spacing):
                angle = shape.start + share * (shape.end - shape.start)
                yield (
                    shape.centre[0] + shape.radius * math.cos(angle),
                    shape.centre[1] + shape.radius * math.sin(angle),
                )
        case _:
            yield shape.centre


def _shares(length: float, spacing: float) -> list[float]:
    """The middles of equal pieces of 0..1."""
    pieces = max(1, round(length / spacing)) if spacing else 1
    return [(piece + 0.5) / pieces for piece in range(pieces)]


class _Projection:
    """A camera, to be asked where points of the ground are in its picture."""

    def __init__(self, camera: PosedCamera) -> None:
        self._pose = camera.pose
        self._lens = camera.intrinsics
        self._distort = _fisheye if camera.intrinsics.model == "fisheye" else _opencv
        self._widest = _turning_back(camera.intrinsics)

    def pixel(self, point: Point) -> tuple[float, float] | None:
        """None: behind the camera, or further out than its lens formula holds."""
        x, y, z = (
            turned + shift
            for turned, shift in zip(
                rotated(self._pose.rotation, [point[0], point[1], 0.0]), self._pose.translation, strict=True
            )
        )
        if z <= 0 or math.hypot(x, y) > self._widest * z:
            return None
        x, y = self._distort(self._lens.distortion, x / z, y / z)
        (fx, skew, cx), (_, fy, cy), _ = self._lens.matrix
        return fx * x + skew * y + cx, fy * y + cy


def _turning_back(lens: Intrinsics) -> float:
    """The distance from the axis (tangent) from which a lens formula takes points back towards the middle."""
    last, distance = 0.0, STEP
    while distance < WIDEST:
        reached = _reach(lens, distance)
        if reached <= last:
            return distance - STEP
        last, distance = reached, distance + STEP
    return math.inf


def _reach(lens: Intrinsics, distance: float) -> float:
    """How far from the middle a point at this distance from the axis comes to lie, by the radial terms alone."""
    if lens.model == "fisheye":
        return _fisheye(lens.distortion, distance, 0.0)[0]
    return distance * _radial(_padded(lens.distortion), distance * distance)


def _padded(distortion: Sequence[float]) -> list[float]:
    return [*distortion, *[0.0] * (14 - len(distortion))]


def _radial(padded: Sequence[float], r2: float) -> float:
    k1, k2, _, _, k3, k4, k5, k6 = padded[:8]
    return (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))


def _opencv(distortion: Sequence[float], x: float, y: float) -> tuple[float, float]:
    padded = _padded(distortion)
    p1, p2 = padded[2:4]
    s1, s2, s3, s4, tau_x, tau_y = padded[8:]
    r2 = x * x + y * y
    radial = _radial(padded, r2)
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + r2 * s4)
    return (xd, yd) if tau_x == tau_y == 0 else _tilted(tau_x, tau_y, xd, yd)


def _tilted(tau_x: float, tau_y: float, x: float, y: float) -> tuple[float, float]:
    """Onto a sensor that is turned by `tau_x` about x, then by `tau_y` about y (rad)."""
    cx, sx, cy, sy = math.cos(tau_x), math.sin(tau_x), math.cos(tau_y), math.sin(tau_y)
    u = cy * x + sy * sx * y - sy * cx
    v = cx * y + sx
    w = sy * x - cy * sx * y + cy * cx
    return (cy * cx * u + sy * cx * w) / w, (cy * cx * v - sx * w) / w


def _fisheye(distortion: Sequence[float], x: float, y: float) -> tuple[float, float]:
    k1, k2, k3, k4 = distortion or [0.0] * 4
    r = math.hypot(x, y)
    if r == 0:
        return x, y
    angle = math.atan(r)
    a2 = angle * angle
    share = angle * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4)))) / r
    return x * share, y * share
