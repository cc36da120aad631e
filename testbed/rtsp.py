"""Starts the RTSP cameras of `testbed/rtsp_cameras.py` and the recorder beside it, and encodes what cameras film."""

from __future__ import annotations

import io
import struct
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

# The Python that Debian's python3-gi is for.
PYTHON = Path("/usr/bin/python3")
HAS_SERVER = """
import gi
gi.require_version("GstRtspServer", "1.0")
from gi.repository import Gst, GstRtspServer
Gst.init(None)
exit(not all(Gst.ElementFactory.find(name) for name in ("appsrc", "h264parse", "rtph264pay")))
"""
LENGTH = struct.Struct("<I")


def has_server() -> bool:
    """Whether GStreamer and its RTSP server are on this machine."""
    return PYTHON.exists() and not subprocess.run([PYTHON, "-c", HAS_SERVER], capture_output=True).returncode


def encode(pictures: Iterable[NDArray[np.uint8]], rate: int, bits: int, path: Path) -> None:
    """Write a clip as the cameras take it, of pictures (H, W, 3): without pictures that are shown out of order.

    No second has more than so many `bits`, as cameras keep it, which a short clip at a mean rate would not.
    """
    encoded, stream = io.BytesIO(), None
    with av.open(encoded, "w", format="h264") as out:
        for picture in pictures:
            if stream is None:
                options = {
                    "preset": "veryfast",
                    "tune": "zerolatency",
                    "g": str(rate),
                    "x264-params": f"sliced-threads=0:vbv-maxrate={bits // 1000}:vbv-bufsize={bits // 1000}",
                }
                stream = out.add_stream("libx264", rate=rate, options=options)
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt, stream.bit_rate = "yuv420p", bits
            out.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        if stream is not None:
            out.mux(stream.encode(None))
    encoded.seek(0)
    with av.open(encoded, format="h264") as clip, path.open("wb") as file:
        for packet in clip.demux(video=0):
            if packet.size:
                file.write(LENGTH.pack(packet.size) + bytes(packet))


@dataclass(frozen=True)
class Cameras:
    """Cameras that film. `addresses`: where; `process`: prints what they take, as `testbed/rtsp_cameras.py` says."""

    addresses: list[str]
    process: subprocess.Popen[str]

    def happen(self, what: str, camera: int, *more: object) -> None:
        """Have something happen to a camera, as `testbed/rtsp_cameras.py` says."""
        assert self.process.stdin is not None
        print(what, camera, *more, file=self.process.stdin, flush=True)

    def taken(self) -> Iterator[Taken]:
        """What they take, as they take it, until they are killed."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            camera, number, at_ns, picture, clip = line.split(maxsplit=4)
            yield Taken(int(camera), int(number), int(at_ns), int(picture), Path(clip.strip()))


@dataclass(frozen=True)
class Taken:
    """A picture that a camera took: its `number` since somebody looks, when (Unix time), which `picture` of a clip."""

    camera: int
    number: int
    at_ns: int
    picture: int
    clip: Path


@contextmanager
def filming(clips: Sequence[Path], rate: float) -> Iterator[Cameras]:
    """Cameras that film these clips."""
    command = [PYTHON, Path(__file__).with_name("rtsp_cameras.py"), str(rate), *clips]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            ports = process.stdout.readline().split()
            yield Cameras([f"rtsp://127.0.0.1:{port}/main" for port in ports], process)
        finally:
            process.kill()


@contextmanager
def recording(file: Path) -> Iterator[str]:
    """The address of a server that records what is published there, as MPEG-TS."""
    command = [PYTHON, Path(__file__).with_name("rtsp_recorder.py"), file]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield f"rtsp://127.0.0.1:{int(process.stdout.readline())}/view"
        finally:
            process.kill()
