"""Warnings about poses from which no field is filmed, with the convention in which they were most likely written.

    warnings = warnings_of(poses, stored)

Each reading of such a pose is tried on the field. A warning names the one under which the camera stands upright, above
and near the field, and sees most of its markings. OpenCV takes its time to load: import this where a venue
was put.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Pose, PosedCamera, PoseIn
from service.schemas.rotation import rotate
from service.schemas.venue import Venue
from service.store.movement import visible_m

# As much as a job needs of it.
LEAST_VISIBLE_M = 15.0
# Limits of where cameras of fields stand: above the ground, and from its centre.
HIGHEST_M, FARTHEST_M = 200.0, 500.0
STEEPEST_ROLL_DEG = 60.0
# Component of the view along the vertical from which a picture has no upright.
STRAIGHT_DOWN = 0.95
# ...and from which it looks down rather than along.
STEEP = 0.7
# A pose from which a field may be filmed is doubted where another reading of it sees so many times as much.
MUCH_MORE = 1.5
# Farther than this beside a field, or higher, hardly a camera stands that films it: a place in feet may.
USUALLY_BESIDE_M, USUALLY_HIGH_M = 100.0, 60.0
METRES_IN_A_FOOT = 0.3048
# Distance of a principal point from the middle of the picture, in parts of its side, that belongs to another picture...
OFF_CENTRE = 0.2
# ...and at most in the one it belongs to.
CENTRED = 0.1


def warnings_of(poses: Sequence[PoseIn], stored: Venue) -> list[str]:
    """Return a line for each camera whose pose or picture size was most likely sent in another convention."""
    lines = []
    for sent, camera in zip(poses, stored.cameras, strict=True):
        lines += [f"camera {camera.id}: {words}" for words in _warnings(stored.field, sent, camera)]
    return lines


@dataclass(frozen=True)
class _Reading:
    """Another meaning of a pose that was sent: the pose that it would be, and in words what to send instead."""

    pose: Pose
    what: str


def _warnings(field: FieldOfPlay, sent: PoseIn, camera: PosedCamera) -> Iterator[str]:
    if _is_exchanged(camera):
        width, height = camera.image_size
        yield (
            f"its principal point lies in the middle of a picture of {height}x{width} pixels, not of {width}x{height}: "
            "is image_size exchanged? It is [width, height]"
        )
    seen = visible_m(field, camera)
    films = seen >= LEAST_VISIBLE_M and _films_a_field(camera.pose)
    if films and not _hangs_over(field, camera.pose):
        yield from _doubted_feet(field, camera)
        return
    # Another reading of a pose from which a field may be filmed has to explain much more.
    least = max(LEAST_VISIBLE_M, MUCH_MORE * seen if films else 0.0)
    if (meant := _meant(field, sent, camera, least)) is not None:
        reading, would_see = meant
        yield f"{_fault(camera.pose, seen)}. It would see {would_see:.0f} m of them if {reading.what}"
    elif not films and (seen < LEAST_VISIBLE_M or math.hypot(*camera.pose.position[:2]) > FARTHEST_M):
        yield (
            f"{_fault(camera.pose, seen)}, and so it does however it is read (camera to world, tvec as position, "
            "centimetres, feet, from a corner): store a first pose that looks at the field"
        )


def _doubted_feet(field: FieldOfPlay, camera: PosedCamera) -> Iterator[str]:
    """Warn of a camera that films the field from very far off, and in feet would stand where cameras do.

    A place in feet that is nearer is not found: nothing but the frame tells it from one in metres.
    """
    if _is_usual_place(field, camera.pose):
        return
    reading = _in_feet(camera.pose)
    if _is_usual_place(field, reading.pose) and not _hangs_over(field, reading.pose):
        seen = visible_m(field, camera.model_copy(update={"pose": reading.pose}))
        if seen >= LEAST_VISIBLE_M:
            x, y, z = camera.pose.position
            yield (
                f"it stands at ({x:.0f}, {y:.0f}, {z:.0f}) m, {_beside_m(field, camera.pose):.0f} m from the field; "
                f"if {reading.what}"
            )


def _fault(pose: Pose, seen_m: float) -> str:
    x, y, z = pose.position
    if seen_m < LEAST_VISIBLE_M:
        return f"its pose sees {seen_m:.0f} m of markings"
    if not _is_near(pose):
        return (
            f"it stands at ({x:.0f}, {y:.0f}, {z:.0f}) m, far from a field of which it sees {seen_m:.0f} m of markings"
        )
    if _films_a_field(pose):
        return f"it hangs {z:.0f} m above the field and sees {seen_m:.0f} m of markings"
    return f"it hangs upside down or on its side, and sees {seen_m:.0f} m of markings"


def _meant(field: FieldOfPlay, sent: PoseIn, camera: PosedCamera, least_m: float) -> tuple[_Reading, float] | None:
    """Return the reading by which a camera sees most metres of markings, and how many; None if below `least_m`.

    Corners come last: they are four more places, of which one now and then sees more by chance than what is meant.
    """
    for readings in (_readings(field, sent, camera.pose), _from_corners(field, camera.pose)):
        films = [reading for reading in readings if _films_a_field(reading.pose)]
        seen = [visible_m(field, camera.model_copy(update={"pose": reading.pose})) for reading in films]
        if seen and max(seen) >= least_m:
            return films[seen.index(max(seen))], max(seen)
    return None


def _readings(field: FieldOfPlay, sent: PoseIn, stored: Pose) -> Iterator[_Reading]:
    """Yield other meanings of a pose. Rotations in degrees are none: those of fields' cameras are beyond 10."""
    backwards = [-component for component in sent.rotation]
    inverse = "its rotation goes from camera to world: send the inverse, world to camera (the negative of the vector)"
    if sent.translation is not None:
        as_position = f"{inverse}, and what is sent as translation as position"
        yield _Reading(Pose.from_position(backwards, sent.translation), as_position)
        as_place = "its translation is the place of the camera: send it as position"
        yield _Reading(Pose.from_position(sent.rotation, sent.translation), as_place)
    if sent.position is not None:
        yield _Reading(Pose.from_position(backwards, sent.position), inverse)
        tvec = PoseIn.model_construct(rotation=sent.rotation, position=None, translation=sent.position)
        yield _Reading(Pose.from_input(tvec), "its position is OpenCV's tvec: send it as translation")
    in_metres = [component / 100 for component in stored.position]
    yield _Reading(Pose.from_position(stored.rotation, in_metres), "its place is in centimetres: send metres")
    if _is_usual_place(field, (in_feet := _in_feet(stored)).pose):
        yield in_feet


def _in_feet(stored: Pose) -> _Reading:
    in_metres = [METRES_IN_A_FOOT * component for component in stored.position]
    return _Reading(Pose.from_position(stored.rotation, in_metres), "its place is in feet: send metres")


def _from_corners(field: FieldOfPlay, stored: Pose) -> Iterator[_Reading]:
    """Yield the position as if it were counted from each corner; the field is symmetric and cannot tell which."""
    x, y, z = stored.position
    for corner_x, corner_y in itertools.product(*((-side / 2, side / 2) for side in (field.length_m, field.width_m))):
        reading = Pose.from_position(stored.rotation, [x + corner_x, y + corner_y, z])
        if not _hangs_over(field, reading):
            yield _Reading(reading, "its place is counted from a corner of the field: count it from the centre")


def _films_a_field(pose: Pose) -> bool:
    """True if a camera stands near a field, above it, and upright or looking straight down."""
    right, down, forward = rotate(pose.rotation, [0.0, 0.0, 1.0])
    if abs(forward) > STRAIGHT_DOWN:
        return _is_near(pose) and forward < 0
    return _is_near(pose) and -down >= math.cos(math.radians(STEEPEST_ROLL_DEG)) * math.hypot(right, down)


def _hangs_over(field: FieldOfPlay, pose: Pose) -> bool:
    """True if a camera would hang above the field itself and look along it, which only cameras at a ceiling do."""
    x, y, _ = pose.position
    _, _, forward = rotate(pose.rotation, [0.0, 0.0, 1.0])
    return abs(x) < field.length_m / 2 and abs(y) < field.width_m / 2 and forward > -STEEP


def _is_usual_place(field: FieldOfPlay, pose: Pose) -> bool:
    """True if a camera stands no farther from a field, and no higher, than cameras usually do."""
    return _beside_m(field, pose) <= USUALLY_BESIDE_M and pose.position[2] <= USUALLY_HIGH_M


def _beside_m(field: FieldOfPlay, pose: Pose) -> float:
    """Return the distance from a camera to the field on the ground, in metres."""
    x, y, _ = pose.position
    return math.hypot(max(0.0, abs(x) - field.length_m / 2), max(0.0, abs(y) - field.width_m / 2))


def _is_near(pose: Pose) -> bool:
    x, y, z = pose.position
    return 0 < z <= HIGHEST_M and math.hypot(x, y) <= FARTHEST_M


def _is_exchanged(camera: PosedCamera) -> bool:
    """True if the camera matrix belongs to a picture with width and height exchanged."""
    (_, _, cx), (_, _, cy), _ = camera.intrinsics.matrix
    width, height = camera.image_size
    return max(_off(cx, width), _off(cy, height)) > OFF_CENTRE and max(_off(cx, height), _off(cy, width)) < CENTRED


def _off(centre: float, side: int) -> float:
    return abs(centre / side - 0.5)
