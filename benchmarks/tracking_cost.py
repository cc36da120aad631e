"""Cost of following: core-ms of a 4K picture and camera by part, `python -m benchmarks.tracking_cost`.

The cameras of `benchmarks.shaking` in 4K, four seconds of each, from the decoder's pictures to their poses, on
one thread; decoding is told beside it. While pieces of line are learned all of them are looked at, then a few.
`--before FOLDER` names a clone of an earlier release, with or without its own `.venv`: its follower gets the same
pictures in colours, as it needs them, in the same run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from benchmarks.shaking import FRAMES_PER_SECOND, Film, stored_camera
from worker.calibration.detection.line_measurement import LineProfiles
from worker.calibration.tracking.follower import CameraTracker
from worker.calibration.tracking.line_observations import LEARNING, TrackedLines
from worker.calibration.tracking.motion_filter import State
from worker.video.yuv_planes import Picture, picture_of

COUNT = 100
PARTS: dict[str, list[tuple[Any, str]]] = {
    "reading pixels": [(Picture, "read")],
    "matching profiles": [(LineProfiles, "read_known")],
    "centres of lines": [(LineProfiles, "measure")],
    "pose by least squares": [(TrackedLines, "explained")],
    "learning": [(TrackedLines, "learn")],
    "filter": [(State, "after"), (State, "with_mast_prior"), (State, "squared_innovation"), (State, "with_observed")],
}
REST, DECODING = "the rest: where lines are expected, choosing pieces", "decoding, beside it"
# Prints the core-ms of each picture in another release: of making colours of it and of following it.
BEFORE = """
import json, sys, time
import av, cv2
from benchmarks import shaking
from worker.video.{pictures} import picture_of
cv2.setNumThreads(1)
Tracker = getattr(shaking, "CameraTracker", None) or shaking.Follower
pitch, made = shaking.clips("4k")
for number, (clip, path) in enumerate(zip(made, sys.argv[1:])):
    tracker = None
    for frame in av.open(path).decode(video=0):
        picture = picture_of(frame)
        begun = time.thread_time()
        colours = picture.colours
        made_colours = time.thread_time()
        if tracker is None:
            stored = shaking.stored_camera(clip.still, number, "exact")
            tracker = Tracker(pitch, [stored], {{stored.id: colours}}, 25.0)
            continue
        tracker.see({{stored.id: colours}})
        tracker.settled()
        print(json.dumps([1000 * (made_colours - begun), 1000 * (time.thread_time() - made_colours)]))
"""


class Meter:
    """Core time by part, each without the parts that it calls."""

    def __init__(self) -> None:
        self.spent_ms: Counter[str] = Counter()
        self._inner = [0.0]

    def of(self, part: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """Return a call whose time is counted."""

        @wraps(call)
        def metered(*given: Any, **named: Any) -> Any:
            begun = time.thread_time()
            self._inner.append(0.0)
            try:
                return call(*given, **named)
            finally:
                spent = time.thread_time() - begun
                self.spent_ms[part] += 1000 * (spent - self._inner.pop())
                self._inner[-1] += spent

        return metered

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """`PARTS` are counted."""
        kept = [(owner, name, owner.__dict__[name]) for of_part in PARTS.values() for owner, name in of_part]
        for part, of_part in PARTS.items():
            for owner, name in of_part:
                call = owner.__dict__[name]
                is_class_method = isinstance(call, classmethod)
                metered = self.of(part, call.__func__ if is_class_method else call)
                setattr(owner, name, classmethod(metered) if is_class_method else metered)
        try:
            yield
        finally:
            for owner, name, call in kept:
                setattr(owner, name, call)


def rows(film: Film) -> list[dict[str, float]]:
    """Return the cost of each picture after the first of each camera, core-ms by part."""
    found = []
    for number, (clip, path) in enumerate(zip(film.clips, film.paths, strict=True)):
        stored = stored_camera(clip.still, number, "exact")
        tracker = None
        meter = Meter()
        see = meter.of(REST, lambda picture, tracker, camera: (tracker.see({camera: picture}), tracker.settled()))
        with av.open(str(path)) as file, meter.at_work():
            file.streams.video[0].thread_count = 1
            frames = file.decode(video=0)
            while True:
                meter.spent_ms.clear()
                frame = meter.of(DECODING, lambda frames=frames: next(frames, None))()
                if frame is None:
                    break
                picture = picture_of(frame)
                if tracker is None:
                    tracker = CameraTracker(film.pitch, [stored], {stored.id: picture.colours}, FRAMES_PER_SECOND)
                    continue
                see(picture, tracker, stored.id)
                found.append(dict(meter.spent_ms))
    return found


def table(found: list[dict[str, float]]) -> list[str]:
    """Markdown: a row for each part, while pieces are learned and afterwards."""
    learning = np.arange(len(found)) % (COUNT - 1) + 1 < LEARNING
    whiles = (learning, ~learning)
    values = {part: np.array([row.get(part, 0.0) for row in found]) for part in (*PARTS, REST, DECODING)}
    values = {"all of following": sum(values[part] for part in (*PARTS, REST))} | values
    lines = ["| core-ms a 4K picture and camera | while pieces are learned | afterwards |", "|---|---|---|"]
    lines += [
        f"| {part} | {' | '.join(f'{each[rows].mean():.1f}' for rows in whiles)} |" for part, each in values.items()
    ]
    return lines


def before(folder: Path, film: Film) -> list[str]:
    """Return the rows of an earlier release."""
    python = folder / ".venv/bin/python"
    (pictures,) = (p.stem for p in (folder / "worker/video").glob("*.py") if "def picture_of(" in p.read_text())
    command = [python if python.exists() else sys.executable, "-c", BEFORE.format(pictures=pictures)]
    paths = [path.resolve() for path in film.paths]
    told = subprocess.run([*command, *paths], cwd=folder, env=os.environ, check=True, stdout=subprocess.PIPE, text=True)
    colours, following = np.mean([json.loads(line) for line in told.stdout.splitlines()], axis=0)
    return [
        f"| before: colours of the whole picture | | {colours:.1f} |",
        f"| before: following in them | | {following:.1f} |",
    ]


def main() -> None:
    """Follow, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, help="a clone of an earlier release")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    film = Film.of("4k", COUNT)
    print("\n".join(table(rows(film))), flush=True)
    if arguments.before is not None:
        print("\n".join(before(arguments.before.resolve(), film)))


if __name__ == "__main__":
    main()
