"""Cameras that are tracked while they film: each stream by itself, its newest picture first, for months.

A picture that comes while an earlier one is looked at takes the place of others that wait. A stream that breaks off, or
whose pictures change their size, is opened again.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, Self

from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.records import CalibrationError
from worker.calibration.tracking.follower import CameraTracker, TrackedPose
from worker.video.clips import Clip, camera_for_clip
from worker.video.errors import VideoError
from worker.video.stream_clock import Lateness
from worker.video.yuv_planes import Picture

# Between two attempts to open a stream, and to find the lines of a camera in a picture.
FIRST_PAUSE_S, LONGEST_PAUSE_S, LOST_PAUSE_S = 1.0, 30.0, 1.0
# A camera that was not looked at for longer is looked for anew. On a busy machine that takes seconds itself, and the
# picture after the one that it was found in comes as much later.
LONGEST_GAP_S = 30.0
# Nobody goes on as it went for longer: where pictures were not even decoded the filter goes in steps of no more.
LONGEST_STEP_S = 0.1
# Pictures without the lines where they were expected, one after the other, after which the camera is looked for anew.
LOST_AFTER_S = 3.0
# A picture that says it is from the future or older than this comes from a camera whose clock is wrong.
EARLIEST_S, LATEST_S = -0.1, 10.0

# Pictures that come so much later than others before them wait somewhere: those that need others are passed by until
# the rest has caught up.
BEHIND_S, CAUGHT_UP_S = 1.0, 0.3

Clock = Literal["rtcp", "arrival"]


@dataclass(frozen=True)
class LivePose:
    """A camera by one picture of its stream.

    `tracked`: pose, sigma and how it is known; `at_ns`: the time that the pose is of, Unix time, and by which `clock`
    that is known: the camera's, told by RTCP, or the `arrival` of the picture; `arrived_ns`: when the picture had been
    decoded; `number`: of the picture, from 0 at the stream's first; `rate`: of the stream.
    """

    tracked: TrackedPose
    at_ns: int
    clock: Clock
    arrived_ns: int
    number: int
    rate: Fraction


@dataclass(frozen=True)
class _ArrivedPicture:
    """A picture, its time in the stream (s), by its camera's clock and when it had been decoded (ns, Unix time)."""

    picture: Picture
    number: int
    stream_s: float
    taken_ns: int | None
    arrived_ns: int


class _NewestPicture:
    """The pictures of a clip as they arrive, decoded in a thread; who comes late gets the newest.

    To be used as a context: it lets go of the clip before that is closed.
    """

    def __init__(self, clip: Clip) -> None:
        self._clip = clip
        self._changed = threading.Condition()
        self._newest: _ArrivedPicture | None = None
        self._ended: BaseException | None = None
        self._over = self._unwanted = False
        self._thread = threading.Thread(target=self._read, name=f"read {clip.camera}", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._unwanted = True
        self._thread.join()

    def __iter__(self) -> Iterator[_ArrivedPicture]:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._over)
                newest, self._newest = self._newest, None
            if newest is None:
                if self._ended is not None:
                    raise self._ended
                return
            yield newest

    def _read(self) -> None:
        lateness, is_behind = Lateness(), False
        try:
            for number, shot in enumerate(self._clip.shots()):
                if self._unwanted:
                    break
                late_s = lateness.of(shot.time_s, time.monotonic()) if self._clip.live else 0.0
                if is_behind != (late_s > (CAUGHT_UP_S if is_behind else BEHIND_S)):
                    is_behind = not is_behind
                    self._clip.decode_whole_pictures_only(is_behind)
                with self._changed:
                    self._newest = _ArrivedPicture(shot.picture, number, shot.time_s, shot.taken_ns, time.time_ns())
                    self._changed.notify()
        except BaseException as error:
            self._ended = error
        with self._changed:
            self._over = True
            self._changed.notify()


@dataclass
class StreamTracker:
    """A camera that is tracked in its stream at `address` by a thread of its own, from where it is `stored`.

    `every`: lines are measured in every so many-th picture; `ahead_s`: poses are told as they will be so long after
    their pictures. `report` takes each pose, `warn` what goes wrong, in words; both are called by that thread.
    """

    pitch: Field
    stored: Camera
    address: str
    every: int
    report: Callable[[LivePose], None]
    warn: Callable[[str], None]
    ahead_s: float = 0.0
    _stop: threading.Event = field(default_factory=threading.Event, init=False)
    _is_clock_right: bool = field(default=True, init=False)

    def start(self) -> None:
        """Begin to track it."""
        threading.Thread(target=self._run, name=f"track {self.stored.id}", daemon=True).start()

    def anchor(self, stored: Camera) -> None:
        """Begin anew from another stored pose, at the next picture."""
        self.stored = stored

    def stop(self) -> None:
        """End after the picture that is looked at."""
        self._stop.set()

    def _run(self) -> None:
        pause_s = FIRST_PAUSE_S
        while not self._stop.is_set():
            opened = time.monotonic()
            try:
                with Clip.open(self.stored.id, self.address, opened) as clip:
                    clip.decode_without_delay()
                    self._track(clip)
                ended = f"camera {self.stored.id}: its stream has ended"
            except VideoError as error:
                ended = str(error)
            if self._stop.is_set():
                return
            # A stream that ran for long begins anew with the shortest pause.
            pause_s = (
                FIRST_PAUSE_S if time.monotonic() - opened > LONGEST_PAUSE_S else min(2 * pause_s, LONGEST_PAUSE_S)
            )
            self.warn(f"{ended}; it is opened again in {pause_s:.0f} s")
            self._stop.wait(pause_s)

    def _track(self, clip: Clip) -> None:
        """Track the camera through a stream until that ends. Raises `VideoError`."""
        tracked: _Track | None = None
        tried_at = -LOST_PAUSE_S
        with _NewestPicture(clip) as pictures:
            for arrived in pictures:
                if self._stop.is_set():
                    return
                if tracked is not None and tracked.goes_on(arrived, self.stored):
                    self._report(tracked.at(arrived, self.ahead_s), arrived, clip.facts.rate)
                elif time.monotonic() - tried_at >= LOST_PAUSE_S:
                    tried_at = time.monotonic()
                    tracked = self._locate(clip, arrived)

    def _report(self, tracked: TrackedPose, arrived: _ArrivedPicture, rate: Fraction) -> None:
        clock: Clock = "arrival"
        at_ns = arrived.arrived_ns
        if arrived.taken_ns is not None and self._is_clock_plausible((arrived.arrived_ns - arrived.taken_ns) / 1e9):
            clock, at_ns = "rtcp", arrived.taken_ns
        ahead_ns = int(self.ahead_s * 1e9)
        self.report(LivePose(tracked, at_ns + ahead_ns, clock, arrived.arrived_ns, arrived.number, rate))

    def _is_clock_plausible(self, delay_s: float) -> bool:
        """Whether the camera's clock can be right, by which a picture arrived so long after it was taken."""
        was_right, self._is_clock_right = self._is_clock_right, EARLIEST_S <= delay_s <= LATEST_S
        if was_right and not self._is_clock_right:
            off, side = abs(delay_s), "behind" if delay_s > 0 else "ahead of"
            self.warn(
                f"camera {self.stored.id}: its clock is {off:.1f} s {side} this machine's, so its pictures count from "
                "when they arrive. Let both keep time by NTP"
            )
        return self._is_clock_right

    def _locate(self, clip: Clip, arrived: _ArrivedPicture) -> _Track | None:
        """Find the camera in a picture, near to where it is stored."""
        stored, rate = self.stored, clip.facts.rate
        camera = camera_for_clip(stored, clip)
        first = {camera.id: arrived.picture.colours}
        try:
            tracker = CameraTracker(self.pitch, [camera], first, float(rate), self.every)
        except CalibrationError:
            self.warn(
                f"camera {camera.id}: its lines are not seen near where the stored pose expects them; its stored pose "
                "is sent. Calibrate the venue, or look at the picture"
            )
            return None
        found = _Track(tracker, stored, 1 / float(rate), arrived.number, arrived.stream_s, time.monotonic())
        self._report(found.now(self.ahead_s), arrived, rate)
        return found


@dataclass
class _Track:
    """A camera that was found in a picture and is tracked since, from where it was `stored`.

    `interval_s`: between pictures, as the stream says; `number` and `stream_s`: of the last picture that was looked at;
    `seen_s`: when its lines were last where they were expected.
    """

    tracker: CameraTracker
    stored: Camera
    interval_s: float
    number: int
    stream_s: float
    seen_s: float

    def goes_on(self, arrived: _ArrivedPicture, stored: Camera) -> bool:
        """Whether the camera can be tracked from where it was: it was seen lately, and no new pose is stored."""
        gap_s = arrived.stream_s - self.stream_s
        return stored is self.stored and 0 <= gap_s <= LONGEST_GAP_S and time.monotonic() - self.seen_s <= LOST_AFTER_S

    def at(self, arrived: _ArrivedPicture, ahead_s: float) -> TrackedPose:
        """The pose by a picture. Pictures that were left out pass as if they had shown nothing."""
        gap_s = arrived.stream_s - self.stream_s
        steps = max(arrived.number - self.number, math.ceil(gap_s / LONGEST_STEP_S))
        # Streams whose times stand still come evenly.
        passed_s = gap_s / steps or self.interval_s
        for _ in range(steps - 1):
            self.tracker.see({}, passed_s)
        self.tracker.see({self.stored.id: arrived.picture} if self.tracker.looks else {}, passed_s)
        self.number, self.stream_s = arrived.number, arrived.stream_s
        return self.now(ahead_s)

    def now(self, ahead_s: float) -> TrackedPose:
        """The newest pose, or the one so long after it; what was before is forgotten."""
        newest = self.tracker.predicted(ahead_s) if ahead_s else self.tracker.now
        (tracked,) = newest.cameras
        self.tracker.settled()
        if tracked.how == "measured":
            self.seen_s = time.monotonic()
        return tracked
