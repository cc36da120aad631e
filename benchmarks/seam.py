"""Steps of brightness and colour at the seam of a stitched view: `python -m benchmarks.seam [--pictures FOLDER]`.

The demo's pair and the real pair are calibrated by a service from outdated poses. Beside each seam, in pieces of a few
rows, the medians of what either camera shows are compared, colour by colour: as they are, and evened out. Printed: the
median piece, in brightness and in colour, and that of nine in ten; with `--pictures` both seams, four times as large.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from benchmarks.real_pair import calibrate
from demo.__main__ import HERE as DEMO
from demo.__main__ import service
from service.client import Client
from service.schemas.job import Job
from service.schemas.venue import Venue, VenueIn
from testbed.real_pair import FOLDER, RealPair
from worker.calibration.geometry.camera import Frame
from worker.calibration.stitching.panorama import Panorama, panorama
from worker.calibration.stitching.photometry import NEUTRAL, Light
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.jobs.from_schemas import camera_of, light_of, pitch_of

WIDTH = 1920
# Beside the seam, and in pieces of so many rows, both in pixels of the view.
BESIDE, PIECE, FEWEST = 20, 24, 200
# Of what is enlarged: columns to either side of the seam.
SHOWN, TIMES = 120, 4
console = Console(highlight=False, soft_wrap=True)


def main() -> int:
    """Measure the demo, and the real pair where its pictures are."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--pictures", type=Path, help="folder for the seams, enlarged")
    asked = arguments.parse_args()
    with tempfile.TemporaryDirectory(prefix="esc-seam-") as data, service(Path(data)) as url, Client(url) as client:
        demo = {camera: DEMO / f"{camera}.jpg" for camera in ("left", "right")}
        tell("demo", client, _of_the_demo(client, demo), demo, asked.pictures)
        if FOLDER.is_dir():
            pair = RealPair.load()
            tell("real pair", client, calibrate(client, pair, "near", 0), pair.files(), asked.pictures)
    return 0


def _of_the_demo(client: Client, files: Mapping[str, Path]) -> Job:
    venue = client.put_venue(VenueIn.model_validate_json((DEMO / "venue.json").read_text()))
    job = client.calibrate(venue.id, {camera: [path] for camera, path in files.items()}, {"seed": 1, "dry_run": True})
    return client.follow(job, lambda _: None)


def tell(name: str, client: Client, job: Job, files: Mapping[str, Path], pictures: Path | None) -> None:
    """Print the steps at a pair's seam, and write its pictures."""
    assert job.result is not None
    assert job.venue is not None
    venue = client.venue(job.venue)
    found = {camera.id: camera for camera in job.result.cameras}
    lights = {camera: light_of(one.light) for camera, one in found.items() if one.light is not None}
    frames = {camera: np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR), np.uint8) for camera, path in files.items()}
    neutral = {camera: replace(NEUTRAL, reach=light.reach) for camera, light in lights.items()}
    for words, made in (("as they are", view_of(venue, job, neutral)), ("evened out", view_of(venue, job, lights))):
        steps = seam_steps(made, frames)
        brightness, colour = np.abs(steps.mean(axis=1)), np.abs(steps).mean(axis=1)
        console.print(
            f"{name:10} {words:12} step at the seam: brightness {_in_words(brightness)}, colours {_in_words(colour)}; "
            f"{len(steps)} pieces"
        )
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(pictures / f"{name} {words}.png".replace(" ", "-")), _enlarged(made, frames))


def _in_words(steps: NDArray[np.float64]) -> str:
    return f"{100 * np.median(steps):.1f} % (nine in ten below {100 * np.quantile(steps, 0.9):.1f} %)"


def view_of(venue: Venue, job: Job, lights: Mapping[str, Light]) -> Panorama:
    """The usual view by the poses that a job found."""
    assert job.result is not None
    cameras = [
        camera_of(camera.model_copy(update={"pose": found.pose}))
        for camera, found in zip(venue.cameras, job.result.cameras, strict=True)
    ]
    pitch = pitch_of(venue.field)
    return panorama(pitch, chosen_view(pitch, cameras, ViewChoice(width=WIDTH)), cameras, lights)


def seam_steps(made: Panorama, frames: Mapping[str, Frame]) -> NDArray[np.float64]:
    """Relative differences (pieces, 3) of what two cameras show beside each piece of their seam: blue, green, red."""
    values, valid = [], []
    for part in made.parts:
        within = ((part.source >= 0) & (part.source <= np.array(part.frame_size) - 1)).all(axis=-1)
        whole = replace(part, weight=within.astype(np.float32))
        values.append(whole.values(frames[part.camera], (slice(None), slice(None))))
        valid.append(within)
    beside = (cv2.dilate(_handed_over(made), np.ones((1, 2 * BESIDE + 1))) > 0) & valid[0] & valid[1]
    steps = []
    for top in range(0, made.size[1], PIECE):
        piece = beside[top : top + PIECE]
        if np.count_nonzero(piece) >= FEWEST:
            a, b = (np.median(each[top : top + PIECE][piece], axis=0) for each in values)
            steps.append(np.log(b / a))
    return np.array(steps)


def _handed_over(made: Panorama) -> NDArray[np.uint8]:
    """1 at the first pixel of a row (H, W) that another camera than its left neighbour's counts most in."""
    owner = made.owner
    found = np.zeros(owner.shape, np.uint8)
    found[:, 1:] = (owner[:, 1:] != owner[:, :-1]) & (owner[:, 1:] >= 0) & (owner[:, :-1] >= 0)
    return found


def _enlarged(made: Panorama, frames: Mapping[str, Frame]) -> Frame:
    columns = np.flatnonzero(_handed_over(made).any(axis=0))
    around = slice(max(int(np.median(columns)) - SHOWN, 0), int(np.median(columns)) + SHOWN)
    shown = made.picture(frames)[:, around]
    return np.asarray(cv2.resize(shown, None, fx=TIMES, fy=TIMES, interpolation=cv2.INTER_CUBIC), np.uint8)


if __name__ == "__main__":
    sys.exit(main())
