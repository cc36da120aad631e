"""Capture times of the pictures of a live stream, by the clock of its camera.

A camera tells by RTCP's sender reports (RFC 3550, 6.4.1) which wall-clock time belongs to a time of its stream. FFmpeg
counts on from the last report and attaches the wall-clock time to the packets of RTSP streams as `AV_PKT_DATA_PRFT`
(`AVProducerReferenceTime`): microseconds since 1970, 64 bits, then 32 bits of flags. Before the first report, and in
streams of other kinds, there is none.
"""

import math
import struct
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from av.packet import Packet

# By so much the clocks of camera and machine may differ, as a part of time.
CLOCKS_DIFFER = 1e-3
WALL_CLOCK_US = struct.Struct("=q")
EARLIEST_S = -0.1
"""Seconds after it was taken that a picture comes: less than so many, and its camera's clock is ahead."""


def clock_in_words(late_s: float) -> str:
    """Say how far a camera's clock is off, by which a picture comes `late_s` seconds after it was taken."""
    side = "behind" if late_s > 0 else "ahead of"
    return f"its clock is {abs(late_s):.1f} s {side} this machine's"


class Lateness:
    """Measures the delay of pictures compared with the promptest ones before."""

    def __init__(self) -> None:
        self._promptest = math.inf
        self._last_s = 0.0

    def of(self, stream_s: float, now_s: float) -> float:
        """Return the delay in seconds of a picture with the time `stream_s`, which arrives at `now_s`."""
        self._promptest += CLOCKS_DIFFER * max(0.0, stream_s - self._last_s)
        self._promptest = min(self._promptest, now_s - stream_s)
        self._last_s = stream_s
        return now_s - stream_s - self._promptest


@dataclass
class StreamClock:
    """Relates the times of a stream to the wall clock, anew with each report."""

    _begin_ns: int | None = None
    """Wall clock of the stream's time 0, nanoseconds since 1970."""
    _has_reported: bool = False

    def learn(self, packet: "Packet[Any]") -> None:
        """Take what a packet says of the wall clock, if it says anything."""
        from av.packet import PacketSideData

        reference_time = bytes(PacketSideData.from_packet(packet, "prft"))
        if len(reference_time) < WALL_CLOCK_US.size or packet.pts is None:
            return
        # FFmpeg's parser ends a picture at the first piece of the next one, to which the first report belongs.
        if self._has_reported:
            (wall_us,) = WALL_CLOCK_US.unpack_from(reference_time)
            self._begin_ns = wall_us * 1000 - _nanoseconds(packet.pts, packet.time_base)
        self._has_reported = True

    def taken_ns(self, pts: int | None, time_base: Fraction | None) -> int | None:
        """Return when a picture of this time of the stream was taken, ns since 1970; None if nothing was reported."""
        if self._begin_ns is None or pts is None or time_base is None:
            return None
        return self._begin_ns + _nanoseconds(pts, time_base)


def _nanoseconds(ticks: int, time_base: Fraction) -> int:
    return int(ticks * time_base * 1_000_000_000)
