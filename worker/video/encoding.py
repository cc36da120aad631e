"""The clip of the view on its way out: encoded in a thread of its own, into a file or to a network address.

A file has its name only once it is whole.
"""

from __future__ import annotations

import queue
import shutil
import subprocess
import threading
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from worker.video.clips import Clip, without_login
from worker.video.errors import VideoError
from worker.video.yuv_planes import BT709, RANGE_LIMITED

if TYPE_CHECKING:
    from av import VideoFrame
    from av.audio.stream import AudioStream
    from av.container import OutputContainer
    from av.packet import Packet

# Pictures that wait for the encoder, beside those that it looks ahead by.
WAITING = 3
FILES = {".mp4": "mp4", ".mov": "mov", ".mkv": "matroska", ".ts": "mpegts"}
STREAMS = {"rtsp": "rtsp", "udp": "mpegts", "srt": "mpegts", "rtmp": "flv"}
SRT = "srt://"
# Whoever joins a stream sees it after so long.
JOINED_S = 1
# Encoders whose quality is a constant rate factor, from 0 (no loss) on, and whose presets go from fast to small.
FACTORED = ("libx264", "libx265")


@dataclass(frozen=True)
class Encoding:
    """Choice of a video encoder of libav; `crf` and `preset` are for those that have them."""

    codec: str = "libx264"
    crf: int = 20
    preset: str = "veryfast"

    @property
    def options(self) -> dict[str, str]:
        """Options of the encoder."""
        return {"crf": str(self.crf), "preset": self.preset} if self.codec in FACTORED else {}


@dataclass(frozen=True)
class Sound:
    """The clip whose sound is kept, and when in its time the view begins."""

    clip: Clip
    begin_s: float


class Writer:
    """Takes one picture after the other. Use it as a context: what ends in an error leaves no file."""

    def __init__(
        self,
        address: str,
        size: tuple[int, int],
        rate: Fraction,
        encoding: Encoding,
        sound: Sound | None = None,
    ) -> None:
        self._address = address
        self._rate, self._count = rate, 0
        self._sound = sound
        self._part = _part(address)
        self._sender = _srt_sender(address) if address.startswith(SRT) else None
        self._container = _opened(address, self._part, self._sender)
        try:
            self._video = _video_stream(self._container, size, rate, encoding)
            if self._part is None:
                self._video.codec_context.gop_size = round(JOINED_S * rate)
            self._audio, self._copied = _audio_stream(self._container, sound.clip.sound if sound else None)
        except BaseException:
            self._discard()
            raise
        self._queue: queue.Queue[tuple[VideoFrame, Sequence[Packet[AudioStream]]] | None] = queue.Queue(WAITING)
        self._sound_queue: deque[Packet[AudioStream]] = deque()
        self._written = 0
        self._error: BaseException | None = None
        self._began = time.monotonic()
        self._thread = threading.Thread(target=self._work, name="write", daemon=True)
        self._thread.start()

    def put(self, frame: VideoFrame, sound: Sequence[Packet[AudioStream]] = ()) -> None:
        """Write the next picture; waits while the encoder is behind. `VideoError` where writing failed before.

        Whoever receives a stream shows it as it comes: it leaves no faster than it is to be seen.
        """
        self._fail_if_failed()
        if self._part is None:
            time.sleep(max(0.0, self._began + float(self._count / self._rate) - time.monotonic()))
        frame.pts, frame.time_base = self._count, 1 / self._rate
        frame.colorspace, frame.color_range = BT709, RANGE_LIMITED
        self._count += 1
        self._queue.put((frame, sound))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._queue.put(None)
        self._thread.join()
        if error is not None or self._error is not None:
            self._discard()
            if error is None:
                self._fail_if_failed()
            return
        try:
            self._container.close()
            if self._sender is not None and self._sent() != 0:
                raise VideoError(f"{without_login(self._address)}: ffmpeg could not send it, see above")
        except Exception as failure:
            self._error = failure
            self._discard()
            self._fail_if_failed()
        if self._part is not None:
            self._part.replace(self._address)

    def _work(self) -> None:
        while (job := self._queue.get()) is not None:
            if self._error is None:
                try:
                    self._write(*job)
                except BaseException as error:
                    self._error = error
        if self._error is None:
            try:
                self._container.mux(self._video.encode(None))
                if self._audio is not None and not self._copied:
                    self._container.mux(self._audio.encode(None))
            except BaseException as error:
                self._error = error

    def _write(self, frame: VideoFrame, sound: Sequence[Packet[AudioStream]]) -> None:
        self._container.mux(self._video.encode(frame))
        self._written += 1
        self._sound_queue.extend(sound)
        # Clips have sound written some way ahead of pictures, and of pictures that follow no more there is to be none.
        while self._sound_queue and (begins_s := self._begins_s(self._sound_queue[0])) < self._written / self._rate:
            self._write_sound(self._sound_queue.popleft(), begins_s)

    def _begins_s(self, packet: Packet[AudioStream]) -> float:
        return 0.0 if self._sound is None else self._sound.clip.sound_time(packet) - self._sound.begin_s

    def _write_sound(self, packet: Packet[AudioStream], begins_s: float) -> None:
        if self._audio is None or begins_s < 0:
            return
        if self._copied:
            shift = (packet.pts or 0) - round(begins_s / packet.time_base)
            packet.pts = (packet.pts or 0) - shift
            packet.dts = packet.pts if packet.dts is None else packet.dts - shift
            packet.stream = self._audio
            self._container.mux(packet)
            return
        for decoded in packet.decode():
            decoded.pts = round(begins_s * decoded.sample_rate)
            decoded.time_base = Fraction(1, decoded.sample_rate)
            begins_s += decoded.samples / decoded.sample_rate
            self._container.mux(self._audio.encode(decoded))

    def _fail_if_failed(self) -> None:
        if self._error is None:
            return
        if isinstance(self._error, VideoError):
            raise self._error
        number = getattr(self._error, "errno", None)
        reason = getattr(self._error, "strerror", None) or str(self._error)
        remainder = "; nothing is left of it" if self._part is not None else ""
        hint = " Free some space or write elsewhere." if number == 28 else ""
        raise VideoError(
            f"{without_login(self._address)} cannot be written: {reason}{remainder}.{hint}"
        ) from self._error

    def _sent(self) -> int:
        """Wait for the sender to end; return its exit code."""
        if self._sender is None or self._sender.stdin is None:
            return 0
        with suppress(OSError):
            self._sender.stdin.close()
        return self._sender.wait()

    def _discard(self) -> None:
        with suppress(Exception):
            self._container.close()
        if self._sender is not None:
            self._sender.kill()
            self._sent()
        if self._part is not None:
            self._part.unlink(missing_ok=True)


def _part(address: str) -> Path | None:
    """The name under which a file is written; `VideoError` for what is no place to write to."""
    scheme, separator, _ = address.partition("://")
    if separator:
        if scheme not in STREAMS:
            raise VideoError(f"{address}: known are files, and {', '.join(f'{name}://' for name in STREAMS)}")
        return None
    path = Path(address)
    if path.suffix.lower() not in FILES:
        raise VideoError(f"{address}: the name of the clip ends in {', '.join(FILES)}")
    if not path.parent.is_dir():
        raise VideoError(f"There is no folder {path.parent}")
    return path.with_name(f"{path.name}.part")


def _opened(address: str, part: Path | None, sender: subprocess.Popen[bytes] | None) -> OutputContainer:
    import av

    if part is not None:
        return av.open(str(part), "w", format=FILES[Path(address).suffix.lower()])
    if sender is not None:
        return av.open(sender.stdin, "w", format="mpegts")
    scheme = address.partition("://")[0]
    options = {"rtsp_transport": "tcp"} if scheme == "rtsp" else {}
    return av.open(address, "w", format=STREAMS[scheme], options=options)


def _srt_sender(address: str) -> subprocess.Popen[bytes]:
    """ffmpeg, which sends by SRT what it is given: the FFmpeg within PyAV cannot."""
    if shutil.which("ffmpeg") is None:
        raise VideoError("srt:// is sent by ffmpeg, which is not on this machine (Debian: apt-get install ffmpeg)")
    source = "-analyzeduration", "100000", "-f", "mpegts", "-i", "pipe:0"
    target = "-c", "copy", "-f", "mpegts", address
    return subprocess.Popen(["ffmpeg", "-v", "error", *source, *target], stdin=subprocess.PIPE)


def _video_stream(container: OutputContainer, size: tuple[int, int], rate: Fraction, encoding: Encoding) -> Any:
    import av

    try:
        codec = av.Codec(encoding.codec, "w")
    except (av.FFmpegError, ValueError):
        some = "libx264, libx265 and prores_ks are some"
        raise VideoError(f"--codec: there is no encoder {encoding.codec}; {some}") from None
    formats = [each.name for each in codec.video_formats or ()]
    stream: Any = container.add_stream(encoding.codec, rate=rate, options=encoding.options)
    stream.width, stream.height = size
    stream.pix_fmt = "yuv420p" if not formats or "yuv420p" in formats else formats[0]
    stream.time_base = 1 / rate
    context = stream.codec_context
    context.colorspace = context.color_primaries = context.color_trc = BT709
    context.color_range = RANGE_LIMITED
    context.thread_type = "AUTO"
    return stream


def _audio_stream(container: OutputContainer, sound: AudioStream | None) -> tuple[Any, bool]:
    """The stream of the sound, and whether packets are copied into it as they are: else they become AAC."""
    if sound is None:
        return None, False
    if sound.codec_context.name in container.supported_codecs:
        return container.add_stream_from_template(sound), True
    stream: Any = container.add_stream("aac", rate=sound.codec_context.sample_rate)
    stream.codec_context.layout = sound.codec_context.layout
    return stream, False
