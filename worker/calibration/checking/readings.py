"""Readings of a pose: the meanings that its numbers have in the conventions that tools and people use.

A file is read in the convention of its format. Where that films no field, or not the lines in the frame, every other
convention is tried: rotations and places the other way round, other units, other axes, another origin. All cameras of a
file are written in one convention.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.geometry.camera import Array, Pose
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.relocalisation.hypotheses import HALF_TURN

Cause = Literal[
    "camera-to-world",
    "place-as-translation",
    "translation-as-place",
    "millimetres",
    "centimetres",
    "feet",
    "camera-axes",
    "world-axes",
    "corner-origin",
]
UNITS: tuple[tuple[Cause | None, float], ...] = (
    (None, 1.0),
    ("millimetres", 0.001),
    ("centimetres", 0.01),
    ("feet", 0.3048),
)
OPENGL = np.diag([1.0, -1.0, -1.0])
"""Rotation from OpenCV's camera axes (y down, z ahead) to OpenGL's (y up, z backwards), and back."""
CORNERS = ((0, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
"""Place of the origin on the field, in halves of its sides."""


@dataclass(frozen=True)
class Reading:
    """One meaning of the poses of a file.

    `causes`: what it takes to differ from the format's convention; `axes` (3, 3) turn the file's world to the field's;
    `corner`: place of its origin on the field, in halves of length and width.
    """

    causes: tuple[Cause, ...]
    scale: float
    camera_axes: Array
    axes: Array
    corner: tuple[int, int]

    def pose(self, given: Pose, half_sides: Array) -> Pose:
        """Return the pose that the numbers of a given one mean; `half_sides` (2,) of the field, m."""
        (rotation,), (position,) = poses_of([self], given, half_sides)
        return Pose(rotation, position)

    @property
    def is_half_turn(self) -> bool:
        """True if its axes are the file's after half a turn about the middle of the field.

        On a field that half a turn does not change, another reading means the same without one.
        """
        return np.array_equal(self.axes, HALF_TURN)

    @property
    def words(self) -> tuple[str, ...]:
        """The causes in words."""
        return tuple(self._words(cause) for cause in self.causes)

    def _words(self, cause: Cause) -> str:
        match cause:
            case "camera-to-world":
                return "its rotations and places go from camera to world"
            case "place-as-translation":
                return "its translations are the places of the cameras"
            case "translation-as-place":
                return "its places are OpenCV's tvec"
            case "camera-axes":
                return "its cameras have y up and z backwards (OpenGL), not y down and z ahead"
            case "world-axes":
                return f"x, y, z of the field are {', '.join(map(_axis, self.axes))} of its world"
            case "corner-origin":
                return "its origin is a corner of the field, not the centre"
            case unit:
                return f"its places are in {unit}, not in metres"


def _axis(row: Array) -> str:
    number = int(np.argmax(np.abs(row)))
    return f"{'-' if row[number] < 0 else ''}{'xyz'[number]}"


def poses_of(readings: Sequence[Reading], given: Pose, half_sides: Array) -> tuple[Array, Array]:
    """Return the rotation vectors (P, 3) and positions (P, 3) that a given pose means by each reading."""
    turned = {causes: _turned(given, causes) for causes in {one.causes for one in readings}}
    rotations, positions = (np.stack(parts) for parts in zip(*(turned[one.causes] for one in readings), strict=True))
    axes = np.stack([one.axes for one in readings])
    matrices = np.stack([one.camera_axes for one in readings]) @ rotations @ axes.swapaxes(1, 2)
    places = np.array([one.scale for one in readings])[:, None] * (axes @ positions[..., None])[..., 0]
    places[:, :2] += np.array([one.corner for one in readings]) * half_sides
    return rotation_vectors(matrices), places


def _turned(given: Pose, causes: Sequence[Cause]) -> tuple[Array, Array]:
    """Return rotation (3, 3), world to camera, and position (3,) of a pose whose parts mean something else."""
    rotation, position, translation = given.matrix, given.position, given.translation
    if "camera-to-world" in causes:
        # What was read as translation is the place: the inverse of the transform.
        return rotation.T, translation.copy()
    if "place-as-translation" in causes:
        return rotation, translation.copy()
    if "translation-as-place" in causes:
        return rotation, -rotation.T @ position
    return rotation, position.copy()


def readings() -> Iterator[Reading]:
    """Yield all readings, the format's own first."""
    ways: tuple[tuple[Cause, ...], ...] = (
        (),
        ("camera-to-world",),
        ("place-as-translation",),
        ("translation-as-place",),
    )
    for way, (unit, scale), flipped, axes, corner in itertools.product(
        ways, UNITS, (False, True), _world_axes(), CORNERS
    ):
        causes: list[Cause] = [*way]
        if unit is not None:
            causes.append(unit)
        if flipped:
            causes.append("camera-axes")
        if not np.array_equal(axes, np.eye(3)):
            causes.append("world-axes")
        if corner != (0, 0):
            causes.append("corner-origin")
        yield Reading(tuple(causes), scale, OPENGL if flipped else np.eye(3), axes, corner)


def _world_axes() -> list[Array]:
    """Return the 24 rotations that exchange axes, that of nothing first."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            axes = np.zeros((3, 3))
            axes[range(3), order] = signs
            if np.linalg.det(axes) > 0:
                found.append(axes)
    return sorted(found, key=lambda axes: -float(np.trace(axes)))
