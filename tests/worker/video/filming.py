"""Clips of a small rendered pitch: two cameras, players who run where both see, any codec, sound if wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from testbed.synthetic import CROWNED, camera, paint_frame
from worker.calibration.geometry.camera import Camera

SIZE = (384, 216)
PITCH = CROWNED
RATE = 25
LEFT, RIGHT = cameras = [
    camera("left", (-1.0, -48.0, 10.0), (-18.0, 0.0), 220.0, size=SIZE),
    camera("right", (1.0, -48.0, 10.0), (18.0, 0.0), 220.0, size=SIZE),
]
# Where players run: middle of their way (m), how far to either side (m), how often a second, and from when on.
PLAYERS = [
    (-6.0, -12.0, 7.0, 0.31, 0.2),
    (4.0, -4.0, 9.0, 0.23, 1.1),
    (0.0, 5.0, 6.0, 0.41, 2.3),
    (2.0, -20.0, 5.0, 0.37, 0.7),
    (-3.0, 14.0, 8.0, 0.19, 1.9),
]
PLAYER = np.array([[dx, dy, z] for dx in (-0.5, 0.5) for dy in (-0.5, 0.5) for z in (0.0, 1.9)])


@cache
def empty(of: str, exposure: float = 1.0) -> NDArray[np.uint8]:
    """The frame of a camera of an empty pitch."""
    return paint_frame(PITCH, next(one for one in cameras if one.id == of), exposure)


def frame_at(of: Camera, time_s: float, exposure: float = 1.0) -> NDArray[np.uint8]:
    """What a camera sees at a time: players are white boxes."""
    picture = empty(of.id, exposure).copy()
    for x, y, far, often, begun in PLAYERS:
        at = np.array([x + far * np.sin(2 * np.pi * often * (time_s + begun)), y, 0.0])
        corners = of.project(at + PLAYER)
        if np.isfinite(corners).all():
            hull = cv2.convexHull(np.rint(16 * corners).astype(np.int32))
            cv2.fillConvexPoly(picture, hull, (240, 240, 240), cv2.LINE_AA, 4)
    return picture


def film(
    path: Path,
    of: Camera,
    seconds: float = 2.0,
    begun_s: float = 0.0,
    rate: Fraction | int = RATE,
    codec: str = "libx264",
    size: tuple[int, int] = SIZE,
    exposure: float = 1.0,
    moving: bool = True,
    times: Sequence[float] | None = None,
    options: dict[str, str] | None = None,
    sound: str | None = None,
    change: Callable[[NDArray[np.uint8], int], NDArray[np.uint8]] = lambda picture, _: picture,
) -> Path:
    """A clip of a camera that began at a time; `times`: of its frames, where they come unevenly."""
    times = times or [n / float(rate) for n in range(round(seconds * float(rate)))]
    with av.open(str(path), "w") as out:
        quality = {"crf": "12", "preset": "ultrafast"} if codec.startswith("libx26") else {}
        stream = out.add_stream(codec, rate=Fraction(rate), options=quality | (options or {}))
        stream.width, stream.height = size
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.thread_count = 1
        stream.codec_context.time_base = Fraction(1, 12800)
        audio = None if sound is None else out.add_stream(sound, rate=48000)
        for number, at in enumerate(times):
            picture = change(frame_at(of, begun_s + at if moving else 0.0, exposure), number)
            if size != SIZE:
                picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
            frame.pts, frame.time_base = round(at * 12800), Fraction(1, 12800)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
        if audio is not None:
            for packet in _beeps(audio, times[-1] + 1 / float(rate), begun_s):
                out.mux(packet)
    return path


def _beeps(stream: av.AudioStream, seconds: float, begun_s: float) -> list[av.Packet]:
    """A tone for the first tenth of every second of the world's time."""
    count = round(seconds * 48000)
    at = begun_s + np.arange(count) / 48000
    tone = (12000 * np.sin(2 * np.pi * 1000 * at) * (at % 1 < 0.1)).astype(np.int16)
    packets = []
    for begin in range(0, count, 1024):
        frame = av.AudioFrame.from_ndarray(tone[None, begin : begin + 1024], format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = 48000, begin, Fraction(1, 48000)
        packets += stream.encode(frame)
    return packets + stream.encode(None)


def frames_of(path: Path) -> list[NDArray[np.uint8]]:
    """The pictures of a clip as a player shows them, BGR."""
    with av.open(str(path)) as clip:
        return [frame.to_ndarray(format="bgr24") for frame in clip.decode(video=0)]
