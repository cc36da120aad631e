"""Core-milliseconds of `esc stitch --seam people` for a picture 1920 pixels wide of two cameras, part by part.

Frames of the rig, enlarged to 1920x1080, become H.264 clips. First the whole way from clips to a clip runs, then each
part alone in one thread, three times over: on a machine that does something else as well the least is the part's own.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import av
import cv2
import numpy as np

from benchmarks.seam_people.__main__ import SEED, seam_points
from benchmarks.seam_people.game import FIELD, RATE, RIGS, Game, calibrated
from benchmarks.seam_people.game import SIZE as GAME_SIZE
from worker.calibration.geometry.camera import Camera
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.people_seam import SeamBand, seam_bands, shows_field
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.video import moving_seams, renderer
from worker.video.clips import Clip
from worker.video.encoding import Encoding, Writer
from worker.video.stitch import Offset, Plan, StitchScene, stitch
from worker.video.yuv_planes import Picture, planes_of

SIZE, WIDTH, ROUNDS = (1920, 1080), 1920, 3
PARTS = {
    "warp": (renderer, "_sample"),
    "light": (renderer, "_corrected"),
    "difference": (moving_seams._Sampler, "values"),
    "cut": (SeamBand, "update"),
    "shares of the blend": (moving_seams, "blend_shares"),
}


def main() -> int:
    """Film, stitch, take the parts, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="2 m", help="name of a rig of two cameras")
    parser.add_argument("--pictures", type=int, default=25)
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        cameras, clips = _film(asked.only, asked.pictures, Path(folder))
        choice = ViewChoice(width=WIDTH)
        began = time.process_time()
        plan = Plan(str(Path(folder) / "all.mp4"), {cameras[1].id: Offset(0.0)}, seam="people")
        times = [began]
        made = stitch(StitchScene(FIELD, cameras, choice), clips, plan, lambda *_: times.append(time.process_time()))
        first_s, whole_s = times[1] - began, times[-1] - times[1]
        print(f"{asked.only}: {made.frames} pictures of {made.size[0]}x{made.size[1]}; core-ms a picture")
        print(f"  the whole way                    {1000 * whole_s / (made.frames - 1):7.1f}, after {first_s:.1f} s")
        for part, core_ms in _parts(cameras, clips, choice, Path(folder) / "parts.mp4").items():
            print(f"  {part:32} {core_ms:7.1f}", flush=True)
    return 0


def _film(name: str, count: int, folder: Path) -> tuple[list[Camera], dict[str, str]]:
    """Return the cameras of larger frames, as they are stored, and a clip of each."""
    rig = next(rig for rig in RIGS if rig.name == name)
    stored = calibrated(rig.cameras(), SEED)
    game = Game(rig, SEED)
    view = chosen_view(FIELD, stored, ViewChoice(width=WIDTH))
    game.start(seam_points(view, panorama(FIELD, view, stored)), count / RATE)
    frames = [game.frames(number) for number in range(count)]
    clips = {camera.id: str(folder / f"{camera.id}.mp4") for camera in stored}
    for camera, path in clips.items():
        with av.open(path, "w") as out:
            stream: Any = out.add_stream("libx264", rate=RATE, options={"preset": "veryfast", "crf": "23"})
            stream.width, stream.height = SIZE
            stream.codec_context.colorspace = stream.codec_context.color_range = 1
            for number, frame in enumerate(frames):
                large = av.VideoFrame.from_ndarray(cv2.resize(frame[camera], SIZE), format="bgr24")
                shot = large.reformat(format="yuv420p", dst_colorspace=1, src_color_range=2, dst_color_range=1)
                shot.pts, shot.time_base = number, Fraction(1, RATE)
                out.mux(stream.encode(shot))
            out.mux(stream.encode(None))
    return [replace(camera, intrinsics=camera.intrinsics.scaled(SIZE[0] / GAME_SIZE[0])) for camera in stored], clips


def _parts(cameras: list[Camera], clips: Mapping[str, str], choice: ViewChoice, output: Path) -> dict[str, float]:
    """Return core-milliseconds a picture of each part."""
    took: dict[str, float] = {}
    for _ in range(ROUNDS):
        here = dict.fromkeys(["decode", *PARTS, "the other rendering", "encode"], 0.0)
        with _timed(here, "decode"):
            shots = {camera: _pictures(camera, path) for camera, path in clips.items()}
        count = min(map(len, shots.values()))
        lights = evened_out(FIELD, cameras, {camera: one[0].colours for camera, one in shots.items()})
        view = chosen_view(FIELD, cameras, choice)
        made = panorama(FIELD, view, cameras, lights)
        seams = moving_seams.MovingSeams(made, seam_bands(made, shows_field(FIELD, view), RATE))
        making = renderer.Renderer(made, 1, seams)
        views = [av.VideoFrame(*view.size, "yuv420p") for _ in range(count)]
        with _timed(here, "the other rendering"), _timed_parts(here):
            for number, frame in enumerate(views):
                making.render({camera: one[number] for camera, one in shots.items()}, planes_of(frame))
        making.close()
        here["the other rendering"] -= sum(here[part] for part in PARTS)
        with _timed(here, "encode"), Writer(str(output), view.size, Fraction(RATE), Encoding(), None) as writer:
            for frame in views:
                writer.put(frame)
        took = {part: min(took.get(part, np.inf), 1000 * core_s / count) for part, core_s in here.items()}
    return took | {"all of them": sum(took.values())}


def _pictures(camera: str, path: str) -> list[Picture]:
    with Clip.open(camera, path) as clip:
        return [shot.picture for shot in clip.shots()]


@contextmanager
def _timed(took: dict[str, float], part: str) -> Iterator[None]:
    began = time.process_time()
    yield
    took[part] += time.process_time() - began


@contextmanager
def _timed_parts(took: dict[str, float]) -> Iterator[None]:
    """Count the core-seconds of each part while it runs."""

    def counted(part: str, run: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*given: Any) -> Any:
            with _timed(took, part):
                return run(*given)

        return timed

    patches = [patch.object(owner, name, counted(part, getattr(owner, name))) for part, (owner, name) in PARTS.items()]
    for one in patches:
        one.start()
    try:
        yield
    finally:
        for one in patches:
            one.stop()


if __name__ == "__main__":
    sys.exit(main())
