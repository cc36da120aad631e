"""`make bench-video`: `esc stitch` beside an ffmpeg that does the same by `remap` and `maskedmerge`, and `cv2.remap`.

Two 4K clips of the demo become one of 3840 pixels in width, by turns, with one encoder and its settings: on a machine
that does something else as well, ratios within a round are what counts. ffmpeg samples the nearest pixel and has no
light to put on (`--lit`: a curve for each colour, no fall-off); `esc stitch` interpolates and puts all of it on.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from service.schemas.venue import VenueIn
from worker.calibration.stitching.panorama import Panorama, panorama
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.photometry import MIDDLE, NEUTRAL
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.jobs.from_schemas import camera_of, pitch_of
from worker.jobs.to_schemas import light_to_schema

DEMO = Path(__file__).parents[1] / "demo"
RATE, NOISE = 25, 2.0
CHOICE = ViewChoice(width=3840, height=1080)
ENCODING = ("-c:v", "libx264", "-preset", "veryfast", "-crf", "20")


@dataclass(frozen=True)
class Took:
    """Cost of a run."""

    wall_s: float
    core_s: float


def main() -> None:
    """Film, run by turns, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--lit", action="store_true", help="evened-out cameras on both sides")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        frames = {side: cv2.imread(str(DEMO / f"{side}.jpg")) for side in ("left", "right")}
        for side, frame in frames.items():
            _film(home / f"{side}.mp4", frame, round(given.seconds * RATE))
        shown = _panorama(home, frames, given.lit)
        _package(home, shown)
        runs = {
            "ffmpeg": lambda: _took(_ffmpeg(home, shown if given.lit else None)),
            "esc stitch": lambda: _took(_esc(home)),
            "decoding alone": lambda: _took([*_ffmpeg_in(home), "-map", "0:v", "-map", "1:v", "-f", "null", "-"]),
        }
        _print(runs, given.rounds, round(given.seconds * RATE))
        print(
            f"cv2.remap alone, blue green red, two cameras, no blend: {_remapping(shown, frames):.0f} core-ms a picture"
        )


def _print(runs: dict[str, Callable[[], Took]], rounds: int, frames: int) -> None:
    seen = {name: [] for name in runs}
    for number in range(rounds):
        for name, run in runs.items():
            seen[name].append(run())
            took = seen[name][-1]
            print(
                f"{number + 1} {name:15} {frames / took.wall_s:6.2f} fps {1000 * took.core_s / frames:6.0f} core-ms",
                flush=True,
            )
    for what in ("wall_s", "core_s"):
        ratios = [getattr(a, what) / getattr(b, what) for a, b in zip(seen["ffmpeg"], seen["esc stitch"], strict=True)]
        print(f"esc stitch makes {statistics.median(ratios):.2f} of ffmpeg's pictures by {what} (median of {rounds})")


def _film(path: Path, frame: np.ndarray, count: int) -> None:
    """A clip in which the picture trembles a little and has the noise of a sensor: codecs have something to do."""
    height, width = frame.shape[:2]
    rng = np.random.default_rng(0)
    noise = rng.normal(0, NOISE, (height + 64, width + 64, 1)).astype(np.float32).repeat(3, axis=2)

    def shaken() -> Iterator[np.ndarray]:
        for number in range(count):
            down, right = rng.integers(0, 64, 2)
            part = noise[down : down + height, right : right + width]
            yield cv2.add(np.roll(frame, number % 8, axis=1), part, dtype=cv2.CV_8U)

    write_clip(path, (width, height), shaken(), RATE)


def write_clip(path: Path, size: tuple[int, int], pictures: Iterable[np.ndarray], rate: int) -> None:
    """Encode pictures of one size as a camera does: H.264 in the colours of HD television."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=Fraction(rate), options={"preset": "veryfast", "crf": "23"})
        stream.width, stream.height = size
        stream.codec_context.colorspace = stream.codec_context.color_range = 1
        for number, picture in enumerate(pictures):
            shot = av.VideoFrame.from_ndarray(picture, format="bgr24")
            shot = shot.reformat(format="yuv420p", dst_colorspace=1, src_color_range=2, dst_color_range=1)
            shot.pts, shot.time_base = number, Fraction(1, rate)
            out.mux(stream.encode(shot))
        out.mux(stream.encode(None))


def _panorama(home: Path, frames: dict[str, np.ndarray], lit: bool) -> Panorama:
    """The view, and the file of the venue that has it."""
    document = json.loads((DEMO / "venue.json").read_text())
    truth = json.loads((DEMO / "truth.json").read_text())["poses"]
    for camera in document["cameras"]:
        camera["pose"] = truth[camera["id"]]
    venue = VenueIn.model_validate(document).to_venue()
    pitch, cameras = pitch_of(venue.field), [camera_of(camera) for camera in venue.cameras]
    found = evened_out(pitch, cameras, frames) if lit else {}
    for camera in document["cameras"]:
        light = found.get(camera["id"])
        camera["light"] = light_to_schema(light or NEUTRAL).model_dump()
    (home / "venue.json").write_text(json.dumps(document))
    return panorama(pitch, chosen_view(pitch, cameras, CHOICE), cameras, found)


def _package(home: Path, shown: Panorama) -> None:
    """Write the maps of ffmpeg: the nearest pixel for each of the view, and how much the second camera counts."""
    for part in shown.parts:
        nearest = np.where(part.weight[..., None] > 0, np.rint(part.source), 65535).clip(0, 65535).astype(np.uint16)
        for axis, name in enumerate("xy"):
            cv2.imwrite(str(home / f"{part.camera}_{name}.pgm"), nearest[..., axis])
    cv2.imwrite(str(home / "mask.pgm"), np.rint(255 * shown.parts[1].weight).astype(np.uint8))


def _ffmpeg_in(home: Path) -> list[str]:
    return ["ffmpeg", "-v", "error", "-y", "-i", str(home / "left.mp4"), "-i", str(home / "right.mp4")]


def _ffmpeg(home: Path, lit: Panorama | None) -> list[str]:
    form = "yuv444p" if lit is None else "gbrp"
    names = ("left_x", "left_y", "right_x", "right_y", "mask")
    maps = [argument for name in names for argument in ("-i", str(home / f"{name}.pgm"))]
    sides = []
    for number in range(2):
        curves = "" if lit is None else f",{_curves(lit, number)}"
        sides.append(f"[{number}:v]format={form}{curves}[c{number}]")
        sides.append(f"[c{number}][{2 + 2 * number}:v][{3 + 2 * number}:v]remap[r{number}]")
    graph = ";".join([*sides, f"[6:v]format={form}[m]", "[r0][r1][m]maskedmerge,format=yuv420p[o]"])
    return [*_ffmpeg_in(home), *maps, "-filter_complex", graph, "-map", "[o]", *ENCODING, str(home / "ffmpeg.mp4")]


def _curves(lit: Panorama, number: int) -> str:
    light = lit.parts[number].light
    power = 1 + light.contrast
    bent = (f"{name}='{gain * MIDDLE}*pow(val/{MIDDLE},{power})'" for name, gain in zip("bgr", light.gain, strict=True))
    return f"lutrgb={':'.join(bent)}"


def _esc(home: Path) -> list[str]:
    clips = [f"{side}={home / side}.mp4" for side in ("left", "right")]
    shown = ["--width", str(CHOICE.width), "--height", str(CHOICE.height)]
    command = [sys.executable, "-m", "service.cli", "stitch", str(home / "venue.json"), *clips]
    return [*command, "-o", str(home / "esc.mp4"), "--offset", "right=0", *shown]


def _took(command: Sequence[str]) -> Took:
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    core_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Took(time.monotonic() - began, core_s)


def _remapping(shown: Panorama, frames: dict[str, np.ndarray], times: int = 10) -> float:
    began = time.process_time()
    for _ in range(times):
        for part in shown.parts:
            cv2.remap(frames[part.camera], part.source, None, cv2.INTER_LINEAR)
    return 1000 * (time.process_time() - began) / times


if __name__ == "__main__":
    main()
