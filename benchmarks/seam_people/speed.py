"""Core-milliseconds of `esc stitch` for a picture 1920 pixels wide of two cameras, with each kind of seam.

Frames of the rig, enlarged to 1920x1080, become H.264 clips that are stitched in one thread. What seams around people
cost is the difference between the two.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import get_args

import cv2

from benchmarks.seam_people.__main__ import SEED, seam_points
from benchmarks.seam_people.game import FIELD, RATE, RIGS, Game, calibrated
from benchmarks.seam_people.game import SIZE as GAME_SIZE
from benchmarks.stitch_video import write_clip
from worker.calibration.geometry.camera import Camera
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.video.stitch import Offset, Plan, Seam, StitchScene, stitch

SIZE, WIDTH = (1920, 1080), 1920


def main() -> int:
    """Film, stitch with each kind of seam, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="2 m", help="name of a rig of two cameras")
    parser.add_argument("--pictures", type=int, default=25)
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        cameras, clips = _film(asked.only, asked.pictures, Path(folder))
        print(f"{asked.only}: {asked.pictures} pictures {WIDTH} pixels wide; core-ms a picture")
        for seam in get_args(Seam):
            first_s, each_s = _stitch(cameras, clips, seam, Path(folder) / f"{seam}.mp4")
            print(f"  {seam:8} {1000 * each_s:7.1f}, after {first_s:.1f} s", flush=True)
    return 0


def _stitch(cameras: list[Camera], clips: Mapping[str, str], seam: Seam, output: Path) -> tuple[float, float]:
    """Return core-seconds until the first picture, and of each of the others."""
    times = [time.process_time()]
    scene = StitchScene(FIELD, cameras, ViewChoice(width=WIDTH))
    plan = Plan(str(output), {cameras[1].id: Offset(0.0)}, seam=seam)
    made = stitch(scene, clips, plan, lambda *_: times.append(time.process_time()))
    return times[1] - times[0], (times[-1] - times[1]) / (made.frames - 1)


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
        write_clip(Path(path), SIZE, (cv2.resize(frame[camera], SIZE) for frame in frames), RATE)
    return [replace(camera, intrinsics=camera.intrinsics.scaled(SIZE[0] / GAME_SIZE[0])) for camera in stored], clips


if __name__ == "__main__":
    sys.exit(main())
