"""Clips of one camera each, files or live streams: opened, looked over, and read as pictures at rising times.

A clip's time is in seconds and 0 at its first picture; that of a live stream counts from `since`, by when its first
picture arrives, or is that of `CameraClocks`.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import httpx

from service import build
from worker.calibration.geometry.camera import Camera
from worker.sources.rtsp_relay import FFMPEG_OPTIONS, Relay
from worker.video.camera_clocks import CameraClocks
from worker.video.errors import VideoError
from worker.video.stream_clock import StreamClock
from worker.video.yuv_planes import Picture, picture_of

if TYPE_CHECKING:
    import av
    from av.audio.stream import AudioStream
    from av.container import InputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream

# Seconds until a live stream is opened, and between two of its packets.
OPENING_S, WAITING_S = 10.0, 10.0
# Where a clip is entered before the time that is wanted: a frame's own time may lie after that of its packet.
EARLIER_S = 1.0
# Frames whose sides are to each other as those of the lens to this part have its aspect ratio.
SAME_ASPECT = 0.005
# Streams that do not know their rate name that of their clock.
USUAL_RATE, HIGHEST_RATE = Fraction(25), 1000
# libav's AV_CODEC_FLAG_LOW_DELAY.
LOW_DELAY = 1 << 19


@dataclass(frozen=True)
class ClipPicture:
    """A picture of a clip at its time.

    `sound`: packets of the sound that came since the shot before; `broken`: frames since then that could not be
    decoded; `taken_ns`: when it was taken by the clock of its camera, Unix time, where a live stream tells.
    """

    time_s: float
    picture: Picture
    sound: Sequence[Packet[AudioStream]] = ()
    broken: int = 0
    taken_ns: int | None = None


@dataclass(frozen=True)
class ClipProperties:
    """Properties of a clip before it is read. `seconds`: its length, None for a live stream."""

    size: tuple[int, int]
    rate: Fraction
    seconds: float | None


@dataclass
class Clip:
    """An opened clip of a camera: close it, or use it as a context."""

    camera: str
    address: str
    container: InputContainer
    video: VideoStream
    facts: ClipProperties
    since: float
    relay: ExitStack
    broken: int = field(default=0, init=False)
    sound: AudioStream | None = field(default=None, init=False)
    _clocks: CameraClocks | None = field(default=None, init=False)
    _clock: StreamClock = field(default_factory=StreamClock, init=False)
    _zero: float | None = field(default=None, init=False)

    @classmethod
    def open(cls, camera: str, address: str, since: float = 0.0) -> Self:
        """Open a clip; `since`, of `time.monotonic`, is for live streams. Raises `VideoError` if it cannot be read."""
        if find_spec("av") is None:
            raise VideoError(f"Video needs PyAV: {build.install_command('video', sys.executable)}")
        import av

        live = is_live(address)
        if not live and not Path(address).is_file():
            raise VideoError(f"camera {camera}: there is no file {address}")
        with ExitStack() as relay:
            container = _open(camera, address, relay)
            if not container.streams.video:
                container.close()
                raise VideoError(f"camera {camera}: there is no video in {without_login(address)}")
            video = container.streams.video[0]
            video.thread_type = "AUTO"
            rates = (rate for rate in (video.average_rate, video.guessed_rate) if rate and rate <= HIGHEST_RATE)
            rate = next(rates, USUAL_RATE)
            seconds = None if live or container.duration is None else container.duration / av.time_base
            size = video.codec_context.width, video.codec_context.height
            facts = ClipProperties(size, Fraction(rate), seconds)
            return cls(camera, address, container, video, facts, since, relay.pop_all())

    @property
    def live(self) -> bool:
        """True for a stream, which cannot be read a second time."""
        return is_live(self.address)

    @property
    def reports_clock(self) -> bool:
        """True if its camera may report when pictures were taken, by RTCP, which belongs to RTSP."""
        return _is_rtsp(self.address)

    @property
    def has_sound(self) -> bool:
        """True if the clip has a sound track."""
        return bool(self.container.streams.audio)

    def listen(self) -> None:
        """Read the sound along with the pictures."""
        self.sound = self.container.streams.audio[0]

    def use_clocks(self, clocks: CameraClocks) -> None:
        """Give pictures the times of their camera's clock, from when all cameras have reported theirs."""
        self._clocks = clocks

    def decode_without_delay(self) -> None:
        """Decode on one core unless pictures come in slices: several cores would hold back a picture each."""
        self.video.codec_context.flags |= LOW_DELAY

    def decode_whole_pictures_only(self, only: bool) -> None:
        """Decode the pictures alone that need no earlier one, and pass by the others, which costs next to nothing."""
        self.video.codec_context.skip_frame = "NONKEY" if only else "DEFAULT"

    def shots(self, begin_s: float = 0.0) -> Iterator[ClipPicture]:
        """Yield the pictures from about a time on; raises `VideoError` for one of another size than the first.

        A live stream goes on from where it was read to.
        """
        self._zero = self._enter(begin_s)
        sound: list[Packet[AudioStream]] = []
        broken, at = 0, 0.0
        for packet in self._packets():
            if packet.stream.type == "audio":
                if packet.pts is not None:
                    sound.append(packet)
                continue
            self._clock.learn(packet)
            frames, lost = _decoded(packet)
            broken += lost
            for frame in frames:
                # What has no times comes evenly.
                at += float(1 / self.facts.rate)
                if frame.pts is not None and frame.time_base is not None:
                    at = float(frame.pts * frame.time_base)
                if frame.is_corrupt:
                    broken += 1
                    continue
                taken_ns = self._clock.taken_ns(frame.pts, frame.time_base)
                time_s = self._time(at, taken_ns)
                if time_s is None:
                    sound, broken = [], 0
                    continue
                self._check(frame, time_s)
                self.broken += broken
                yield ClipPicture(time_s, picture_of(frame), sound, broken, taken_ns)
                sound, broken = [], 0
        self.broken += broken

    def sound_time(self, packet: Packet[AudioStream]) -> float:
        """Return when a packet of sound begins, in the clip's time (s)."""
        return float((packet.pts or 0) * packet.time_base) - (self._zero or 0.0)

    def close(self) -> None:
        """Close the file or stream."""
        self.container.close()
        self.relay.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _enter(self, begin_s: float) -> float | None:
        """Seek a time in a file; return when it begins in its own time, None if only its first picture tells."""
        if self.live:
            return self._zero
        if self.video.start_time is None or self.video.time_base is None:
            return None
        start = float(self.video.start_time * self.video.time_base)
        if begin_s > EARLIER_S:
            self.container.seek(int((start + begin_s - EARLIER_S) / self.video.time_base), stream=self.video)
        return start

    def _time(self, at: float, taken_ns: int | None) -> float | None:
        """Return the clip's time of a picture, `at` in its own; None while cameras have not reported their clocks."""
        if self._clocks is None:
            if self._zero is None:
                # Live streams that are opened one after the other are in time by when their pictures arrive.
                self._zero = at - (time.monotonic() - self.since if self.live else 0.0)
            return at - self._zero
        if not self._clocks.report(self.camera, taken_ns) or taken_ns is None:
            return None
        time_s = self._clocks.time_s(taken_ns)
        # Sound has no clock of its own.
        self._zero = at - time_s
        return time_s

    def _packets(self) -> Iterator[Packet[AudioStream] | Packet[VideoStream]]:
        import av

        streams = (self.video,) if self.sound is None else (self.video, self.sound)
        try:
            packets = iter(self.container.demux(*streams))
            while True:
                asked_s = time.monotonic()
                packet = next(packets, None)
                # When a stream is silent for too long FFmpeg hands out what it had held back, and would wait once more.
                if packet is None or (self.live and time.monotonic() - asked_s > WAITING_S):
                    return
                yield packet  # type: ignore[misc]
        except av.EOFError:
            return
        except (av.FFmpegError, OSError) as error:
            # A stream that breaks off and a file that is cut off end here: what there was is kept.
            if not self.live and not isinstance(error, av.InvalidDataError):
                raise VideoError(f"camera {self.camera}: {self.address} cannot be read: {_words(error)}") from None

    def _check(self, frame: av.VideoFrame, at_s: float) -> None:
        if (frame.width, frame.height) != self.facts.size:
            width, height = self.facts.size
            raise VideoError(
                f"camera {self.camera}: at {at_s:.2f} s its picture changes from {width}x{height} to "
                f"{frame.width}x{frame.height} pixels; cut the clip there"
            )
        if frame.rotation:
            raise VideoError(
                f"camera {self.camera}: the clip says that players are to turn it by {frame.rotation} degrees, and its "
                "lens was measured in frames that may have been turned or not. Store it as it was calibrated: "
                "ffmpeg -display_rotation 0 -i CLIP -c copy OTHER leaves the frames as they are (before version 6: "
                "-metadata:s:v rotate=0), ffmpeg -i CLIP OTHER turns them"
            )


def camera_for_clip(camera: Camera, clip: Clip | None) -> Camera:
    """Return the camera with a lens for the frames of its clip. Raises `VideoError` where they have another shape."""
    if clip is None or clip.facts.size == camera.intrinsics.size:
        return camera
    (width, height), (expected_width, expected_height) = clip.facts.size, camera.intrinsics.size
    if not width or abs(width * expected_height / (height * expected_width) - 1) > SAME_ASPECT:
        raise VideoError(
            f"camera {camera.id}: its clip has {width}x{height} pixels, its lens was measured for "
            f"{expected_width}x{expected_height}. The same picture at another size would do; this one is of another "
            "shape: cut, or from another mode of the camera. Record in the mode in which the lens was measured"
        )
    lens = camera.intrinsics.scaled(width / expected_width)
    return camera.with_lens(lens if lens.size == clip.facts.size else replace(lens, size=clip.facts.size))


def is_live(address: str) -> bool:
    """Return True for the address of a stream, False for a file."""
    return "://" in address


def without_login(address: str) -> str:
    """Return an address without the user and password of a stream."""
    return _split_login(address)[0]


def _split_login(address: str) -> tuple[str, str | None]:
    """Return an address without user and password, and these as they stand in it."""
    scheme, separator, rest = address.partition("://")
    authority = re.match("[^/?#]*", rest)
    if not separator or authority is None:
        return address, None
    login, at, host = authority[0].rpartition("@")
    return f"{scheme}://{host}{rest[authority.end() :]}", login if at else None


def _is_rtsp(address: str) -> bool:
    return address.startswith(("rtsp://", "rtsps://"))


def _open(camera: str, address: str, stack: ExitStack) -> InputContainer:
    """Open a file, or a stream: one of RTSP through a relay, which `stack` ends. Raises `VideoError`."""
    import av

    shown, login = _split_login(address)
    relay = None
    try:
        if _is_rtsp(address):
            target = httpx.URL(shown)
            relay = stack.enter_context(Relay(target, [target.host], login))
        return av.open(
            address if relay is None else relay.url,
            "r",
            options={} if relay is None else FFMPEG_OPTIONS,
            timeout=(OPENING_S, WAITING_S) if is_live(address) else None,
        )
    except (av.FFmpegError, OSError, httpx.InvalidURL) as error:
        why = (relay and relay.why) or _words(error)
        raise VideoError(f"camera {camera}: {shown} is no clip: {why}") from None


def _decoded(packet: Packet[VideoStream]) -> tuple[list[av.VideoFrame], int]:
    """Decode a packet; return the pictures that it completes and the number of broken ones."""
    import av

    try:
        return packet.decode(), 0
    except av.FFmpegError:
        return [], 1


def _words(error: BaseException) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
