"""`make bench-seam-people`: what seams make of people who cross them, beside OpenCV's seam finders and a feather.

Clips of 22 people and a ball are rendered for rigs of two to four cameras, 0.5 to 40 m apart; stored poses are a little
off, exposures differ, sensors have noise. Truth is each object's outline in each camera. Of each person that two
cameras show, pixels that a view lacks are cut, those it has beside the person are doubled, what it shows to a part is a
ghost; the person of the camera that explains most counts as meant. All areas are px²·s, for each crossing of a seam.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.seam_people.game import FIELD, RATE, RIGS, Game, Rig, calibrated
from benchmarks.seam_people.methods import RARELY, Method, methods, shown_by
from benchmarks.seam_people.scores import Lines, Score, truths
from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.stitching.panorama import Panorama, panorama
from worker.calibration.stitching.people_seam import shows_field
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.views import StitchedView, ViewChoice, chosen_view

WIDTH = 1280
SEED = 3


def main() -> int:
    """Run the rigs, print a table of each and their sum."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="names of rigs")
    parser.add_argument("--methods", nargs="*", default=[], help="beginnings of names of seams")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--clips", type=Path, help="folder that keeps rendered frames for the next run")
    parser.add_argument("--pictures", type=Path, help="folder for contact sheets")
    asked = parser.parse_args()
    sums: dict[str, list[float]] = {}
    for rig in RIGS:
        if not asked.only or any(rig.name == name for name in asked.only):
            for name, wrong in _of_rig(rig, asked).items():
                sums.setdefault(name, []).append(wrong)
    print("all rigs, wrong area per crossing: " + ", ".join(f"{name} {np.mean(one):.1f}" for name, one in sums.items()))
    return 0


def _of_rig(rig: Rig, asked: argparse.Namespace) -> dict[str, float]:
    stored = calibrated(rig.cameras(), SEED)
    view = chosen_view(FIELD, stored, ViewChoice(width=WIDTH))
    clip = _Clip(rig, asked.seconds, asked.clips)
    made = panorama(FIELD, view, stored, evened_out(FIELD, stored, clip.empty_frames()))
    clip.game.start(seam_points(view, made), asked.seconds)
    lines = Lines(made, view, stored, rig.cameras())
    compared = [
        one
        for one in methods(made, shows_field(FIELD, view))
        if not asked.methods or any(map(one.name.startswith, asked.methods))
    ]
    scores = {one.name: Score(one.every / RATE) for one in compared}
    sheets: dict[str, list[Frame]] = {one.name: [] for one in compared}
    rises = [part.rise[..., None] for part in made.parts]
    count = round(asked.seconds * RATE)
    sheet_moments = {RARELY * round((2 * number + 1) * count / (8 * RARELY)) for number in range(4)}
    for number in range(count):
        shown = shown_by(made, rises, clip.frames(number))
        here = truths(clip.game, view, made, number)
        for one in compared:
            if number % one.every:
                continue
            weights = one.weights(shown)
            scores[one.name].add(here, weights, shown, lines)
            if asked.pictures is not None and number in sheet_moments:
                sheets[one.name].append(_drawn(made, shown, weights))
    if asked.pictures is not None:
        _write_sheet(asked.pictures, rig.name, sheets)
    return _print(rig, _crossings(clip.game, view, made, count), compared, scores, lines)


class _Clip:
    """The frames of a game, rendered, or as an earlier run kept them."""

    def __init__(self, rig: Rig, seconds: float, folder: Path | None) -> None:
        self._folder = None if folder is None else folder / f"{rig.name} {seconds:g} s"
        self.game = Game(rig, SEED)

    def empty_frames(self) -> dict[str, Frame]:
        """Return a frame of each camera without anybody in it."""
        return self._kept("empty", self.game.empty_frames)

    def frames(self, number: int) -> dict[str, Frame]:
        """Return the frame of each camera at a moment."""
        return self._kept(f"{number:04d}", lambda: self.game.frames(number))

    def _kept(self, name: str, render: Callable[[], dict[str, Frame]]) -> dict[str, Frame]:
        if self._folder is None:
            return render()
        self._folder.mkdir(parents=True, exist_ok=True)
        files = {camera.id: self._folder / f"{name} {camera.id}.jpg" for camera in self.game.cameras}
        if not all(file.exists() for file in files.values()):
            for camera, frame in render().items():
                cv2.imwrite(str(files[camera]), frame, [cv2.IMWRITE_JPEG_QUALITY, 95])
        return {camera: np.asarray(cv2.imread(str(file)), np.uint8) for camera, file in files.items()}


def seam_points(view: StitchedView, made: Panorama) -> Array:
    """Return points (N, 2) of the field on the static seams."""
    rows, columns = np.nonzero(_seam_mask(made))
    ground = view.behind(FIELD, np.stack([columns, rows], axis=-1)[None].astype(float))[0, :, :2]
    return ground[(np.abs(ground) < [FIELD.length / 2, FIELD.width / 2]).all(axis=1)]


def _seam_mask(made: Panorama) -> NDArray[np.bool_]:
    owner = made.owner
    return (owner[:, 1:] != owner[:, :-1]) & (owner[:, 1:] >= 0) & (owner[:, :-1] >= 0)


def _crossings(game: Game, view: StitchedView, made: Panorama, count: int) -> int:
    """Return how often feet, or the ball, pass from one camera's part to another's."""
    owner, total = made.owner, 0
    for index in range(len(game.runners) + 1):
        owners = []
        for number in range(count):
            spot = game.ball(number) if index == len(game.runners) else game.runners[index].at(number / RATE).foot
            column, row = np.rint(view.project(np.asarray(spot)[None])[0]).astype(int)
            if 0 <= column < view.size[0] and 0 <= row < view.size[1]:
                owners.append(int(owner[row, column]))
        total += int(np.count_nonzero(np.diff(owners)))
    return total


def _print(
    rig: Rig, crossings: int, compared: list[Method], scores: dict[str, Score], lines: Lines
) -> dict[str, float]:
    print(f"{rig.name}: {rig.count} cameras, {crossings} crossings; px²·s per crossing")
    print(
        "                 pictures  wrong    cut  doubled vanished ghosted  jumps    moved flicker  bent steady  CPU ms"
    )
    each = max(crossings, 1)
    wrong = {}
    for one in compared:
        score = scores[one.name]
        seconds = len(score.offsets) * score.step_s
        parts = [part / each for part in (score.wrong, score.cut, score.doubled, score.vanished, score.ghosted)]
        offsets = np.array(score.offsets)
        steady = float(np.sqrt(np.mean(np.var(offsets, axis=0).sum(axis=-1))))
        print(
            f"  {one.name:14} {one.calls:8} {parts[0]:7.2f} {parts[1]:6.2f} {parts[2]:8.2f} {parts[3]:8.2f} "
            f"{parts[4]:7.2f} {score.handed_over / each:6.2f} {score.moved / seconds:8.0f} "
            f"{score.flicker / seconds:7.0f} {lines.bent(score.offsets):5.2f} {steady:6.3f} "
            f"{1000 * one.took_s / one.calls:7.1f}",
            flush=True,
        )
        wrong[one.name] = parts[0]
    return wrong


def _drawn(made: Panorama, shown: list[NDArray[np.float32]], weights: list[NDArray[np.float32]]) -> Frame:
    picture = sum(weight[..., None] * one for weight, one in zip(weights, shown, strict=True))
    picture = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
    best = np.argmax(weights, axis=0)
    edge = np.zeros(best.shape, np.uint8)
    edge[:, 1:] = best[:, 1:] != best[:, :-1]
    edge[1:] |= (best[1:] != best[:-1]).astype(np.uint8)
    picture[edge > 0] = (0, 0, 255)
    columns = np.flatnonzero(_seam_mask(made).any(axis=0))
    # One of the seams, where there are several.
    middle = int(columns[len(columns) // (2 if len(made.parts) == 2 else 5)])
    return picture[:, max(middle - 200, 0) : middle + 200]


def _write_sheet(folder: Path, name: str, sheets: dict[str, list[Frame]]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for method, pictures in sheets.items():
        row = np.concatenate(pictures, axis=1)
        cv2.putText(row, method, (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (255, 255, 255), 2)
        rows.append(row)
    cv2.imwrite(str(folder / f"{name}.png".replace(" ", "-").replace(",", "")), np.concatenate(rows))


if __name__ == "__main__":
    sys.exit(main())
