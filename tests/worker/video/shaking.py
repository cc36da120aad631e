"""Clips of two cameras on a mast that sways: the rendered pair, each of its pictures turned."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from testbed.synthetic import pair, pair_frames
from worker.calibration.detection.frame_fusion import Sway
from worker.calibration.geometry.camera import Array, Camera

RATE = 25
COUNT = 24


def turn(number: int, phase: float) -> Array:
    """0.3 degrees at 0.5 Hz about each axis, from where the camera stands in its first picture on."""
    phases = phase + np.array([0.0, 1.0, 2.0])
    return np.radians(0.3) * (np.sin(np.pi * number / RATE + phases) - np.sin(phases))


def shaken(camera: Camera, picture: NDArray[np.uint8], phase: float, count: int = COUNT) -> Iterator[NDArray[np.uint8]]:
    """What a camera of the pair sees while it sways, 50 pictures a sway."""
    for number in range(count):
        yield Sway.from_turn(-turn(number, phase), camera.intrinsics).rows(picture, 0, len(picture))


def film_shaking(folder: Path, count: int = COUNT) -> dict[str, str]:
    """A clip of each camera, by its name."""
    rig = zip(pair(), pair_frames(), (0.0, 1.5), strict=True)
    return {camera.id: _film(folder, camera, picture, phase, count) for camera, picture, phase in rig}


def film_left(folder: Path) -> str:
    """A clip of the left camera alone."""
    return _film(folder, pair()[0], pair_frames()[0], 0.0, COUNT)


def _film(folder: Path, camera: Camera, picture: NDArray[np.uint8], phase: float, count: int) -> str:
    path = folder / f"{camera.id}.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=RATE, options={"crf": "14", "preset": "ultrafast"})
        stream.width, stream.height = camera.intrinsics.size
        stream.pix_fmt, stream.thread_count = "yuv420p", 1
        stream.codec_context.time_base = Fraction(1, 12800)
        for at, seen in enumerate(shaken(camera, picture, phase, count)):
            frame = av.VideoFrame.from_ndarray(seen, format="bgr24")
            frame.pts, frame.time_base = at * 12800 // RATE, Fraction(1, 12800)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    return str(path)
