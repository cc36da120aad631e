"""Stored poses, sent repeatedly at the rate of the pictures, with smooth transitions to newly accepted ones."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction

from service.formats.lens import NumberedCamera
from service.live.destinations import PoseSender
from service.schemas.geometry import Pose
from service.schemas.venue import Camera, Venue

STORED = "stored"
# Smaller changes of a pose are spread over `MOVED_IN_S`, invisibly; larger ones were wrong poses, and apply at once.
SMALL_TURN_RAD, SMALL_MOVE_M, MOVED_IN_S = math.radians(0.5), 0.1, 1.0
# After a sleep of the machine, missed samples beyond this are skipped.
MOST_MISSED_S = 1.0


@dataclass(frozen=True)
class _Transition:
    """Transition of a camera to a newer pose, since `begun` (`time.monotonic`)."""

    before: Camera
    after: Camera
    begun: float

    def at(self, now: float) -> Camera:
        """Return the camera at a time."""
        share = min((now - self.begun) / MOVED_IN_S, 1.0)
        if share == 1.0 or not _is_small_step(self.before, self.after):
            return self.after
        rotation, position = (
            [(1 - share) * old + share * new for old, new in zip(one, other, strict=True)]
            for one, other in (
                (self.before.pose.rotation, self.after.pose.rotation),
                (self.before.pose.position, self.after.pose.position),
            )
        )
        return self.after.model_copy(update={"pose": Pose.from_position(rotation, position)})


def _is_small_step(before: Camera, after: Camera) -> bool:
    turned = math.dist(before.pose.rotation, after.pose.rotation)
    moved = math.dist(before.pose.position, after.pose.position)
    return before.intrinsics == after.intrinsics and turned <= SMALL_TURN_RAD and moved <= SMALL_MOVE_M


@dataclass
class StoredPoses:
    """Poses of a venue over time. Thread-safe."""

    venue: Venue
    _transitions: dict[str, _Transition] = field(default_factory=dict, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __post_init__(self) -> None:
        self._transitions = {camera.id: _Transition(camera, camera, 0.0) for camera in self.venue.cameras}

    def replace(self, venue: Venue, now: float) -> list[str]:
        """Begin transitions to the poses of a venue. Return the ids of cameras whose poses or lenses are new."""
        with self._lock:
            before = {camera: transition.at(now) for camera, transition in self._transitions.items()}
            stored = {id: (one.after.pose, one.after.intrinsics) for id, one in self._transitions.items()}
            new = [one.id for one in venue.cameras if stored.get(one.id) != (one.pose, one.intrinsics)]
            self._transitions = {
                camera.id: _Transition(before.get(camera.id, camera), camera, now)
                if camera.id in new
                else self._transitions[camera.id]
                for camera in venue.cameras
            }
            return new

    def at(self, now: float) -> list[NumberedCamera]:
        """Return the cameras at a time (`time.monotonic`), in the order of the venue."""
        with self._lock:
            return [NumberedCamera(one.at(now), number) for number, one in enumerate(self._transitions.values(), 1)]


def send_stored_poses(
    poses: StoredPoses,
    sender: PoseSender,
    rate: Fraction,
    stop: threading.Event,
    is_tracked: Callable[[str], bool] = lambda _: False,
) -> None:
    """Send a sample of each camera `rate` times a second until `stop`.

    The beat follows the machine's clock without drift. Tracked cameras are left out.
    """
    begun, beats = time.monotonic(), 0
    while not stop.is_set():
        stored = [camera for camera in poses.at(time.monotonic()) if not is_tracked(camera.id)]
        if stored:
            sender.send(stored, time.time_ns(), rate, STORED)
        beats += 1
        wait_s = begun + float(beats / rate) - time.monotonic()
        if wait_s < -MOST_MISSED_S:
            begun, beats, wait_s = time.monotonic(), 0, 0.0
        stop.wait(max(wait_s, 0.0))
