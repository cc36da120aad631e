"""Choice of the picture of each clip nearest to a moment; pictures are read ahead by a thread."""

import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from worker.video.clips import Clip, ClipPicture
from worker.video.errors import VideoError

if TYPE_CHECKING:
    from av.audio.stream import AudioStream
    from av.packet import Packet

# Pictures that are decoded ahead, beside those that the decoder itself needs.
AHEAD = 3
# How long the nearest good picture stands in for broken ones.
LONGEST_GAP_S = 1.0
# A clip ends so many of its frames after the time of its last picture.
LAST_SHOWN = 0.75


class FrameReader:
    """Pictures of a clip from a time on, decoded in a thread. Close it: the thread waits where nobody takes them."""

    def __init__(self, clip: Clip, begin_s: float = 0.0) -> None:
        self._clip, self._begin_s = clip, begin_s
        self._queue: queue.Queue[ClipPicture | BaseException | None] = queue.Queue(AHEAD)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._read, name=f"read {clip.camera}", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[ClipPicture]:
        while True:
            found = self._queue.get()
            if found is None:
                return
            if isinstance(found, BaseException):
                raise found
            yield found

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        while self._thread.is_alive():
            try:
                self._queue.get(timeout=0.1)
            except queue.Empty:
                continue

    def _read(self) -> None:
        try:
            for shot in self._clip.shots(self._begin_s):
                self._queue.put(shot)
                if self._over.is_set():
                    return
            self._queue.put(None)
        except BaseException as error:
            self._queue.put(error)


@dataclass
class ClipTrack:
    """The pictures of a clip by the time of all: `offset_s` later than the clip's own."""

    camera: str
    shots: Iterator[ClipPicture]
    offset_s: float
    interval_s: float
    live: bool = False
    repeated: int = field(default=0, init=False)
    sound: "list[Packet[AudioStream]]" = field(default_factory=list, init=False)
    _now: ClipPicture | None = field(default=None, init=False)
    _next: ClipPicture | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self._now = next(self.shots, None)
        if self._now is None:
            raise VideoError(f"camera {self.camera}: no picture of its clip can be decoded, from where it is to begin")
        self._next = next(self.shots, None)
        self._collect_sound(self._now)

    @property
    def begin_s(self) -> float:
        """Beginning of the clip in the time of all (s); a live stream begins when it arrives."""
        return self.offset_s + (self._now.time_s if self.live and self._now is not None else 0.0)

    def at(self, time_s: float) -> ClipPicture | None:
        """Return the nearest picture, None once the clip has ended; raises `VideoError` if too many were broken."""
        own = time_s - self.offset_s
        while self._next is not None and self._now is not None and self._next.time_s - own <= own - self._now.time_s:
            self._now = self._next
            self._collect_sound(self._now)
            self._next = next(self.shots, None)
        if self._now is None:
            return None
        if self._next is None and own > self._now.time_s + LAST_SHOWN * self.interval_s:
            return None
        self._bridge(own, self._now)
        return self._now

    def _bridge(self, own: float, shown: ClipPicture) -> None:
        """Count and limit the pictures that stand in for broken ones."""
        if self._next is not None and self._next.broken:
            gap = self._next.time_s - shown.time_s
            if gap > LONGEST_GAP_S + self.interval_s:
                raise VideoError(
                    f"camera {self.camera}: {self._next.broken} frames from {shown.time_s:.2f} s on cannot be decoded, "
                    f"and the next good one is {gap:.2f} s later; more than {LONGEST_GAP_S:g} s is not bridged. "
                    "Cut the clip there, or copy it again"
                )
        is_next_to_broken = shown.broken or (self._next is not None and self._next.broken)
        if is_next_to_broken and abs(own - shown.time_s) > LAST_SHOWN * self.interval_s:
            self.repeated += 1

    def _collect_sound(self, shot: ClipPicture | None) -> None:
        if shot is not None:
            self.sound.extend(shot.sound)
