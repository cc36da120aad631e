"""`esc live` beside cameras that shake: what it sends, each pose beside where the camera really was."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from numpy.typing import NDArray

from benchmarks.shaking import FRAMES_PER_SECOND, SIZES, SWING_HZ, Clip, stored_camera
from demo.render import HERE
from testbed.rtsp import Cameras, Taken, encode, filming
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.jobs.to_schemas import posed_camera_to_schema

FOLDER, VENUE = Path("build/live"), "demo"
# After so many pictures of a clip the motion of its camera is as it was.
PERIOD = round(FRAMES_PER_SECOND / SWING_HZ)
# A pose belongs to a picture that was taken no farther from its time than this.
SAME_MS = 15.0

Truth = Callable[[int], Camera]


@dataclass(frozen=True)
class Film:
    """Format of the cameras: pictures of a `size`, so many a second, of which the clips have whole multiples."""

    size: str
    rate: float

    @property
    def every(self) -> int:
        """Step between the pictures of a clip that are filmed."""
        return round(FRAMES_PER_SECOND / self.rate)

    @property
    def bits(self) -> int:
        """Bits of a second: as many for each picture, whatever the rate."""
        return round(SIZES[self.size][2] / self.every)

    def file(self, name: str) -> Path:
        """Return the file of what a camera films, by a name of it."""
        return FOLDER / f"{name}-{self.size}-{self.rate:g}"

    def pictures(self, clip: Clip) -> Iterator[NDArray[np.uint8]]:
        """Return the pictures that a camera films of a clip, again and again."""
        return (clip.frame(number) for number in range(0, PERIOD, self.every))

    def truth(self, clip: Clip) -> Truth:
        """Return the true camera by the number of a picture of a clip."""
        return lambda picture: clip.camera(self.every * picture)


@dataclass(frozen=True)
class SentPose:
    """A line that was printed, and when (`at_ns`, Unix time)."""

    at_ns: int
    line: Mapping[str, Any]

    @property
    def camera(self) -> str:
        """Id of the camera."""
        return str(self.line["camera"])

    @property
    def status(self) -> str:
        """Status of the pose: measured, coasted, refused or stored."""
        return str(self.line["status"])

    @property
    def time_ns(self) -> float:
        """Time at which the picture was taken, by the line."""
        return datetime.fromisoformat(self.line["time"]).timestamp() * 1e9


@dataclass(frozen=True)
class JudgedPose:
    """A pose beside the truth: errors in degrees, metres and their own sigmas; `late_ms`: since it was taken."""

    sent: SentPose
    turn_deg: float
    turn_in_sigma: float
    shift_m: float
    shift_in_sigma: float
    late_ms: float


@dataclass
class LiveRun:
    """`esc live` and the cameras it tracks, while they run; what was sent, taken and said stays afterwards.

    `truths`: by the file of what is filmed where its camera was at each picture of that.
    """

    names: list[str]
    truths: dict[Path, Truth]
    cameras: Cameras
    process: subprocess.Popen[str]
    sent: list[SentPose] = field(default_factory=list)
    taken: dict[str, list[Taken]] = field(default_factory=dict)
    warnings: list[tuple[int, str]] = field(default_factory=list)

    def note(self) -> None:
        """Keep what comes, in threads."""
        for read in (self._note_taken, self._note_sent, self._note_warnings):
            threading.Thread(target=read, daemon=True).start()

    def judged(self, camera: str, begin_ns: float = 0, end_ns: float = math.inf) -> list[JudgedPose]:
        """The poses of a camera that were sent in a time, of which it is known by the camera's clock when they were."""
        pictures = list(self.taken.get(camera, ()))
        times = np.array([picture.at_ns for picture in pictures])
        found = []
        for sent in self.of(camera, begin_ns, end_ns):
            if sent.line.get("clock") != "rtcp" or not pictures:
                continue
            later = min(int(np.searchsorted(times, sent.time_ns)), len(times) - 1)
            nearest = min((max(later - 1, 0), later), key=lambda number: abs(times[number] - sent.time_ns))
            if abs(times[nearest] - sent.time_ns) < SAME_MS * 1e6:
                found.append(self._judge(sent, pictures[nearest]))
        return found

    def of(self, camera: str, begin_ns: float = 0, end_ns: float = math.inf) -> list[SentPose]:
        """The poses of a camera that were sent in a time."""
        return [sent for sent in list(self.sent) if sent.camera == camera and begin_ns <= sent.at_ns < end_ns]

    def _judge(self, sent: SentPose, taken: Taken) -> JudgedPose:
        true, line = self.truths[taken.clip](taken.picture).pose, sent.line
        turn = rotation_angles_deg(np.array(line["rotation"]), true.rotation)
        shift = float(np.linalg.norm(np.array(line["position"]) - true.position))
        by_turn, by_shift = turn / line["sigma_rotation_deg"], shift / line["sigma_position_m"]
        return JudgedPose(sent, turn, by_turn, shift, by_shift, (sent.at_ns - taken.at_ns) / 1e6)

    def _note_taken(self) -> None:
        for taken in self.cameras.taken():
            self.taken.setdefault(self.names[taken.camera], []).append(taken)

    def _note_sent(self) -> None:
        for line in self.process.stdout or ():
            self.sent.append(SentPose(time.time_ns(), json.loads(line)))

    def _note_warnings(self) -> None:
        for line in self.process.stderr or ():
            self.warnings.append((time.time_ns(), line.rstrip()))


@contextmanager
def running(
    clips: Sequence[Clip], others: Mapping[Path, Clip], film: Film, *options: str, url: str | None = None
) -> Iterator[LiveRun]:
    """Run `esc live` on cameras that film these clips; the `others`, which they may film later, are encoded too.

    Their venue is of the service at `url`, as `VENUE`, or a file.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    paths = [film.file(clip.still.id) for clip in clips]
    truths: dict[Path, Truth] = {}
    for path, clip in [*zip(paths, clips, strict=True), *others.items()]:
        if not path.exists():
            encode(film.pictures(clip), round(film.rate), film.bits, path)
        truths[path] = film.truth(clip)
    venue = json.loads((HERE / "venue.json").read_text())
    stored = [stored_camera(clip.still, number, "exact") for number, clip in enumerate(clips)]
    venue["cameras"] = [posed_camera_to_schema(camera).model_dump(mode="json", exclude_unset=True) for camera in stored]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    if url is None:
        named = str(FOLDER / "venue.json")
        Path(named).write_text(json.dumps(venue))
    else:
        named = VENUE
        httpx.put(f"{url}/venues/{VENUE}", json=venue).raise_for_status()
        environment["ESC_URL"] = url
    with filming(paths, film.rate) as cameras:
        names = [camera.id for camera in stored]
        streams = [f"{name}={address}" for name, address in zip(names, cameras.addresses, strict=True)]
        command = [
            sys.executable,
            "-m",
            "service.cli",
            "live",
            named,
            *streams,
            "--json",
            *options,
        ]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment) as live:
            run = LiveRun(names, truths, cameras, live)
            run.note()
            try:
                yield run
            finally:
                live.terminate()
