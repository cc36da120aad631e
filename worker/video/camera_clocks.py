"""Live streams that are put in time by the clocks of their cameras, as RTCP reports tell them.

A stream's pictures are dropped until all cameras have reported, so that none of them waits while others go on. The time
of all is Unix time, in seconds since the streams were opened.
"""

import threading
import time
from collections.abc import Iterable

from worker.video.errors import VideoError
from worker.video.stream_clock import EARLIEST_S, clock_in_words

# Cameras report every five seconds or so (RFC 3550, 6.2), FFmpeg takes the second report at the latest.
REPORTED_WITHIN_S = 12.0
# A picture that says it is older than this comes from a camera whose clock is wrong: the first ones may have waited.
LATEST_S = 10.0


class CameraClocks:
    """Reports of the clocks of all cameras, shared by the threads that read their streams."""

    def __init__(self, cameras: Iterable[str]) -> None:
        self._begun_ns = time.time_ns()
        self._until = time.monotonic() + REPORTED_WITHIN_S
        self._silent = set(cameras)
        self._fault: str | None = None
        self._lock = threading.Lock()

    def report(self, camera: str, taken_ns: int | None) -> bool:
        """Take the time (ns, Unix time) of a picture that has just come; return True once all cameras have reported.

        Raises `VideoError` where one has not in time, and where a clock differs too far from this machine's.
        """
        with self._lock:
            if taken_ns is not None and camera in self._silent:
                late_s = (time.time_ns() - taken_ns) / 1e9
                if not EARLIEST_S <= late_s <= LATEST_S:
                    self._fault = (
                        f"camera {camera}: {clock_in_words(late_s)}. Let both keep time by NTP, or take pictures as "
                        f"they arrive: --offset {camera}=0"
                    )
                self._silent.discard(camera)
            if self._silent and time.monotonic() > self._until:
                silent = sorted(self._silent)
                self._fault = self._fault or (
                    f"camera {silent[0]}: its stream does not say when its pictures were taken (no RTCP sender report "
                    f"within {REPORTED_WITHIN_S:g} s). --offset takes pictures as they arrive, in seconds after those "
                    f"of the first camera: --offset {silent[0]}=0"
                )
            if self._fault is not None:
                raise VideoError(self._fault)
            return not self._silent

    def time_s(self, taken_ns: int) -> float:
        """The time of all that a picture was taken at (ns, Unix time)."""
        return (taken_ns - self._begun_ns) / 1e9
