"""Cameras that are tracked while they film: each stream by itself, its newest picture first, for months.

A picture that comes while an earlier one is looked at takes the place of others that wait. A stream that breaks off, or
whose pictures change their size, is opened again.
"""

import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, Self

import cv2
import numpy as np

from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.records import CalibrationError
from worker.calibration.tracking.follower import CameraTracker, TrackedPose
from worker.video.clips import Clip, camera_for_clip
from worker.video.errors import VideoError
from worker.video.stillness import Stillness
from worker.video.stream_clock import EARLIEST_S, Lateness, clock_in_words
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
# A prompt picture that says it is older than this comes from a camera whose clock is wrong.
LATEST_S = 2.0
# A picture that is older is not where the camera looks now.
NEWEST_S = 2.0
# A pose that is known no better than this is found by lines that do not fit: zoom or focus are others than stored.
UNSURE_DEG = 0.2
# By so much a clock does not go astray between two pictures: it was set.
CLOCK_WAS_SET_S = 0.25

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
    """A picture, its time in the stream (s), by its camera's clock and when it had been decoded (ns, Unix time).

    `late_s`: how late it came beside the promptest ones of the stream; `shows_new`: it, or one that it took the place
    of, is not the same as the one before; `is_frozen`: nearly all before it were.
    """

    picture: Picture
    number: int
    stream_s: float
    late_s: float
    taken_ns: int | None
    arrived_ns: int
    shows_new: bool
    is_frozen: bool


class _NewestPicture:
    """The pictures of a clip as they arrive, decoded in a thread; who comes late gets the newest.

    To be used as a context: it lets go of the clip before that is closed. `latest`: the last one that showed something
    new, whoever looks at it.
    """

    latest: _ArrivedPicture | None = None

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
        lateness, stillness, is_behind = Lateness(), Stillness(), False
        try:
            for number, shot in enumerate(self._clip.shots()):
                if self._unwanted:
                    break
                late_s = lateness.of(shot.time_s, time.monotonic()) if self._clip.live else 0.0
                if is_behind != (late_s > (CAUGHT_UP_S if is_behind else BEHIND_S)):
                    is_behind = not is_behind
                    self._clip.decode_whole_pictures_only(is_behind)
                shows_new = stillness.shows_new(shot.picture.planes[0], shot.time_s)
                with self._changed:
                    self._newest = _ArrivedPicture(
                        shot.picture,
                        number,
                        shot.time_s,
                        late_s,
                        shot.taken_ns,
                        time.time_ns(),
                        shows_new or (self._newest is not None and self._newest.shows_new),
                        stillness.is_frozen,
                    )
                    if shows_new:
                        self.latest = self._newest
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
    their pictures. `report` takes each pose, `warn` why there are none, in words, and `remark` what is odd about those
    that there are; all are called by that thread.
    """

    pitch: Field
    stored: Camera
    address: str
    every: int
    report: Callable[[LivePose], None]
    warn: Callable[[str], None]
    remark: Callable[[str], None]
    ahead_s: float = 0.0
    _stop: threading.Event = field(default_factory=threading.Event, init=False)
    _is_clock_right: bool = field(default=True, init=False)
    _clock_offset_s: float | None = field(default=None, init=False)
    _do_lines_fit: bool = field(default=True, init=False)
    _pictures: _NewestPicture | None = field(default=None, init=False)
    _unseen_since: float | None = field(default=None, init=False)

    def start(self) -> None:
        """Start the thread that tracks the camera."""
        threading.Thread(target=self._run, name=f"track {self.stored.id}", daemon=True).start()

    def anchor(self, stored: Camera) -> None:
        """Begin anew from another stored pose, at the next picture."""
        self.stored = stored
        self._unseen_since = None

    @property
    def unseen_s(self) -> float:
        """Seconds for which pictures have come whose lines were not found where they are expected."""
        unseen_since = self._unseen_since
        return 0.0 if unseen_since is None or self._latest() is None else time.monotonic() - unseen_since

    def newest_frame(self) -> Frame | None:
        """Return the newest picture, in the size of its lens, or None if it is old or frozen."""
        latest = self._latest()
        if latest is None:
            return None
        size = self.stored.intrinsics.size
        frame = latest.picture.colours
        return frame if latest.picture.size == size else np.asarray(cv2.resize(frame, size), np.uint8)

    def _latest(self) -> _ArrivedPicture | None:
        """Return the newest picture that shows something new, unless it is old."""
        latest = None if self._pictures is None else self._pictures.latest
        return None if latest is None or time.time_ns() - latest.arrived_ns > NEWEST_S * 1e9 else latest

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
        self._clock_offset_s = None
        with _NewestPicture(clip) as pictures:
            self._pictures = pictures
            for arrived in pictures:
                if self._stop.is_set():
                    return
                if arrived.shows_new:
                    self._unseen_since = self._unseen_since or time.monotonic()
                if tracked is not None and tracked.goes_on(arrived, self.stored):
                    self._report(tracked.at(arrived, self.ahead_s), arrived, clip.facts.rate)
                elif arrived.shows_new and time.monotonic() - tried_at >= LOST_PAUSE_S:
                    tried_at = time.monotonic()
                    tracked = self._locate(clip, arrived)
                if arrived.is_frozen:
                    self.warn(f"camera {self.stored.id}: its picture is frozen, each one is the same as the one before")

    def _report(self, tracked: TrackedPose, arrived: _ArrivedPicture, rate: Fraction) -> None:
        clock: Clock = "arrival"
        at_ns = arrived.arrived_ns
        if arrived.taken_ns is not None and self._is_clock_plausible(arrived, arrived.taken_ns):
            clock, at_ns = "rtcp", arrived.taken_ns
        if tracked.how == "measured" and tracked.sigma.rotation_deg < UNSURE_DEG:
            self._unseen_since = None
        ahead_ns = int(self.ahead_s * 1e9)
        self.report(LivePose(tracked, at_ns + ahead_ns, clock, arrived.arrived_ns, arrived.number, rate))

    def _is_clock_plausible(self, arrived: _ArrivedPicture, taken_ns: int) -> bool:
        """Return True if the camera's clock is plausible for a picture; report changes of that."""
        # From when a prompt picture is taken to its arrival, by both clocks.
        delay_s = (arrived.arrived_ns - taken_ns) / 1e9 - arrived.late_s
        # The camera's clock less the time in its stream, which only changes if that clock is set.
        offset_s = taken_ns / 1e9 - arrived.stream_s
        was_right, self._is_clock_right = self._is_clock_right, EARLIEST_S <= delay_s <= LATEST_S
        set_by_s = 0.0 if self._clock_offset_s is None else offset_s - self._clock_offset_s
        self._clock_offset_s = offset_s
        if was_right and not self._is_clock_right:
            self.remark(
                f"camera {self.stored.id}: {clock_in_words(delay_s)}"
                f"{', or its pictures are so long on their way' if delay_s > 0 else ''}, so they count from when they "
                "arrive. Let both keep time by NTP"
            )
        elif self._is_clock_right and not was_right:
            self.remark(f"camera {self.stored.id}: its clock is right again, so its pictures count by it")
        elif self._is_clock_right and abs(set_by_s) > CLOCK_WAS_SET_S:
            side = "forward" if set_by_s > 0 else "back"
            self.remark(
                f"camera {self.stored.id}: its clock was set {side} by {abs(set_by_s):.1f} s, and the times of its "
                "poses with it"
            )
        return self._is_clock_right

    def _locate(self, clip: Clip, arrived: _ArrivedPicture) -> "_Track | None":
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
        sigma_deg = tracker.now.cameras[0].sigma.rotation_deg
        did_fit, self._do_lines_fit = self._do_lines_fit, sigma_deg < UNSURE_DEG
        if did_fit and not self._do_lines_fit:
            self.remark(
                f"camera {camera.id}: its lines do not fit well, its pose is known to {sigma_deg:.1f} degrees. "
                "Have zoom or focus changed? Calibrate the venue"
            )
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
        """Return True if the camera was seen lately and its stored pose is the same, so that tracking can go on."""
        gap_s = arrived.stream_s - self.stream_s
        return stored is self.stored and 0 <= gap_s <= LONGEST_GAP_S and time.monotonic() - self.seen_s <= LOST_AFTER_S

    def at(self, arrived: _ArrivedPicture, ahead_s: float) -> TrackedPose:
        """Return the pose by a picture. Skipped pictures, and one that shows nothing new, only pass time."""
        gap_s = arrived.stream_s - self.stream_s
        steps = max(arrived.number - self.number, math.ceil(gap_s / LONGEST_STEP_S))
        # Streams whose times stand still come evenly.
        passed_s = gap_s / steps or self.interval_s
        for _ in range(steps - 1):
            self.tracker.see({}, passed_s)
        is_seen = arrived.shows_new and self.tracker.looks
        self.tracker.see({self.stored.id: arrived.picture} if is_seen else {}, passed_s)
        self.number, self.stream_s = arrived.number, arrived.stream_s
        return self.now(ahead_s)

    def now(self, ahead_s: float) -> TrackedPose:
        """Return the newest pose, or the one predicted for `ahead_s` later; earlier ones are forgotten."""
        newest = self.tracker.predicted(ahead_s) if ahead_s else self.tracker.now
        (tracked,) = newest.cameras
        self.tracker.settled()
        if tracked.how == "measured":
            self.seen_s = time.monotonic()
        return tracked
