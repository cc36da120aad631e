"""`make bench-truth`: whether looking nearby first ever answers something else than a search.

    python -m benchmarks.drifts --count 6
    python -m benchmarks.drifts

Cameras turn by so many pixels of their picture, and move a centimetre, from where they are; then they are calibrated
from there: as in a job (`search: auto`), and by a search in any case. Rendered frames and, where it is there, the real
pair, through the real U-Net. Every run is written to `runs/bench/drifts.jsonl` and not run again; remove the file after
a change of the engine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.methods import Seen, engine
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER, Scene, scene
from benchmarks.truth import apart
from testbed.real_pair import FOLDER as REAL
from testbed.real_pair import RealPair
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import moved

DRIFTS_PX = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0)
SHIFT_M = 0.01
ALIKE_M, ALIKE_DEG = 2e-4, 5e-4


@dataclass(frozen=True)
class Run:
    """One drift: the path taken, whether all was accepted, and how far both answers are apart, m and degrees."""

    path: str
    accepted: bool
    shift_m: float
    turn_deg: float

    @property
    def alike(self) -> bool:
        """Whether a search would have answered the same."""
        return self.shift_m <= ALIKE_M and self.turn_deg <= ALIKE_DEG


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="drifts of each size, for each venue")
    options = parser.parse_args()
    for line in table(options.count):
        print(line, flush=True)


def table(count: int) -> Iterator[str]:
    """A row for each venue and size of drift."""
    yield "| venue | drift, px | runs | accepted | nearby | of those, as by a search | farthest apart, mm | degrees |"
    yield "|---|---|---|---|---|---|---|---|"
    for venue in VENUES:
        if venue == "real pair" and not REAL.is_dir():
            yield f"The real pair is not there: put it into {REAL}."
            continue
        for drift in DRIFTS_PX:
            runs = [_run(venue, drift, number) for number in range(count)]
            near = [run for run in runs if run.path == "near"]
            shift = max((1000 * run.shift_m for run in near), default=0.0)
            turn = max((run.turn_deg for run in near), default=0.0)
            yield (
                f"| {venue} | {drift:.0f} | {len(runs)} | {sum(run.accepted for run in runs)} | {len(near)} "
                f"| {sum(run.alike for run in near)} | {shift:.2f} | {turn:.5f} |"
            )


def _run(venue: str, drift_px: float, number: int) -> Run:
    key = {"venue": venue, "drift": drift_px, "number": number}
    row = _rows().remembered(key, lambda: vars(_compared(venue, drift_px, number)))
    return Run(**{name: value for name, value in row.items() if name != "key"})


def _compared(venue: str, drift_px: float, number: int) -> Run:
    seen = _seen(venue)
    rng = np.random.default_rng([13, int(drift_px), number])
    begun = [_drifted(camera, drift_px, rng) for camera in seen.scene.cameras]
    said = engine()(seen, begun, number).said
    assert said is not None
    if said.path == "wide":
        return Run(said.path, said.accepted, 0.0, 0.0)
    searched = engine(search="wide")(seen, begun, number).cameras
    shifts, turns = zip(*(apart(a.camera, b) for a, b in zip(said.cameras, searched, strict=True)), strict=True)
    return Run(said.path, said.accepted, max(shifts), max(turns))


def _drifted(camera: Camera, drift_px: float, rng: np.random.Generator) -> Camera:
    turn, shift = rng.normal(size=3), rng.normal(size=3)
    turn *= drift_px / camera.intrinsics.focal_length_px / np.linalg.norm(turn)
    return moved(camera, np.concatenate([turn, SHIFT_M * shift / np.linalg.norm(shift)]))


@cache
def _rows() -> Rows:
    return Rows(FOLDER / "drifts.jsonl")


@cache
def _seen(venue: str) -> Seen:
    return Seen(VENUES[venue]())


def _real_pair() -> Scene:
    """From where it is found; nobody knows where it really stands."""
    pair = RealPair.load()
    frames = {name: list(each) for name, each in pair.frames().items()}
    given = Scene("real", False, pair.pitch, pair.cameras, pair.cameras, frames)
    found = engine(search="wide")(Seen(given), pair.started("near", 0), 0).cameras
    return replace(given, cameras=found, real=found)


VENUES: dict[str, Callable[[], Scene]] = {
    "rendered pair": lambda: scene("pair-real-1"),
    "rendered camera": lambda: scene("one-real"),
    "real pair": _real_pair,
}

if __name__ == "__main__":
    main()
