"""Memory of a camera: its stored pose and lens, its first nights, its last ones, and how it looked before.

The anchor does not follow: a lens that creeps by a hair a night is compared with what it was in the first nights, and
not with what it was yesterday. Only accepted jobs are remembered.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import LinePoints
from worker.calibration.memory.epoch import Epoch, camera_from_json, camera_to_json

FORMAT = 1
WIND = np.array([0.003] * 3 + [0.03] * 3)
ANCHOR_JOBS = 8
"""Number of jobs that make up the anchor."""


@dataclass(frozen=True)
class AcceptedJob:
    """Result of an accepted job, as the memory of a camera takes it.

    `found`: the camera with its accepted pose; `measured`: its line measurements, of the `lines` of the field; `at`:
    when the frames were taken, None if not known; `repainted_markings`: numbers of the markings that lie elsewhere than
    remembered; `frames`: the fingerprint of the job's frames; `zoomed`: True if the focal length has surely changed
    since the first nights.
    """

    found: Camera
    measured: Measurements
    lines: LinePoints
    at: datetime | None
    repainted_markings: tuple[int, ...] = ()
    frames: str = ""
    zoomed: bool = False

    @property
    def for_epoch(self) -> tuple[Camera, Measurements, LinePoints, datetime | None]:
        """Arguments of `Epoch.from_job` and `Epoch.joined`."""
        return self.found, self.measured, self.lines, self.at

    def without(self, markings: Sequence[int]) -> "AcceptedJob":
        """Return the job without the measurements of some markings."""
        return replace(self, measured=self.measured[~np.isin(self.measured.points.marking, markings)])


@dataclass(frozen=True)
class CameraMemory:
    """Memory of one camera: its first stored pose, and the epochs of its accepted jobs.

    `origin`: the camera as it was stored before its first job; `anchor`: the first jobs, `recent`: those since, and
    `earlier` ones that looked another way or had another lens; `repainted_markings`: numbers of the markings that have
    been painted elsewhere since, of which nothing is remembered; `lines`: the fingerprint of the field's line points;
    `frames`: of the last job's frames.
    """

    origin: Camera
    anchor: Epoch
    recent: Epoch | None
    earlier: tuple[Epoch, ...]
    repainted_markings: tuple[int, ...]
    lines: str
    frames: str = ""

    @classmethod
    def from_first_job(cls, stored: Camera, job: AcceptedJob) -> "CameraMemory":
        """Return the memory of the first accepted job, which found a camera that was `stored` before."""
        arguments = job.without(job.repainted_markings).for_epoch
        return cls(
            stored, Epoch.from_job(*arguments), None, (), job.repainted_markings, fingerprint(job.lines), job.frames
        )

    def after(self, job: AcceptedJob) -> "CameraMemory":
        """Return the memory with one more accepted job; the same frames sent again say nothing new."""
        if job.frames == self.frames:
            return self
        kept = replace(self.aware_of(job.repainted_markings, job.lines), frames=job.frames)
        arguments = job.without(kept.repainted_markings).for_epoch
        if kept.takes_for_anchor(job):
            return replace(kept, anchor=kept.anchor.joined(*arguments))
        if kept.recent is None:
            return replace(kept, recent=Epoch.from_job(*arguments))
        if kept.recent.looks_like(job.found, job.lines):
            return replace(kept, recent=kept.recent.joined(*arguments))
        # A few jobs are no epoch.
        before = [*kept.earlier, kept.recent] if kept.recent.jobs >= 4 else list(kept.earlier)
        # Another way of looking tells lens and ground apart.
        return replace(kept, recent=Epoch.from_job(*arguments), earlier=tuple(before[-2:]))

    def takes_for_anchor(self, job: AcceptedJob) -> bool:
        """True if a job is one of the first nights, with camera and lens as in the very first."""
        begins = self.recent is None and self.anchor.jobs < ANCHOR_JOBS
        return begins and not job.zoomed and self.anchor.looks_like(job.found, job.lines)

    @property
    def epochs(self) -> list[Epoch]:
        """All epochs: the anchor, the recent one if there is one, and earlier ones."""
        return [self.anchor, *([self.recent] if self.recent else []), *self.earlier]

    @property
    def last(self) -> Epoch:
        """Epoch of the last jobs."""
        return self.recent or self.anchor

    @property
    def jobs(self) -> int:
        """Number of accepted jobs in it."""
        return sum(epoch.jobs for epoch in self.epochs)

    @property
    def since(self) -> datetime | None:
        """Middle of the first nights, from which changes are counted."""
        first, last = self.anchor.first, self.anchor.last
        return first if first is None or last is None else first + (last - first) / 2

    def aware_of(self, repainted_markings: Sequence[int] | NDArray[np.intp], lines: LinePoints) -> "CameraMemory":
        """Return the memory without what it knew of markings that were painted elsewhere."""
        aside = np.union1d(self.repainted_markings, repainted_markings).astype(int)
        if len(aside) == len(self.repainted_markings):
            return self
        gone = np.flatnonzero(np.isin(lines.marking, aside))
        return replace(
            self,
            repainted_markings=tuple(aside.tolist()),
            anchor=self.anchor.without(gone),
            recent=self.recent and self.recent.without(gone),
            earlier=tuple(epoch.without(gone) for epoch in self.earlier),
        )

    def to_json(self) -> dict[str, Any]:
        """Return the memory as a JSON object, about 10 kB an epoch."""
        return {
            "format": FORMAT,
            "lines": self.lines,
            "origin": camera_to_json(self.origin),
            "anchor": self.anchor.to_json(),
            "recent": None if self.recent is None else self.recent.to_json(),
            "earlier": [epoch.to_json() for epoch in self.earlier],
            "aside": list(self.repainted_markings),
            "frames": self.frames,
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "CameraMemory | None":
        """Return the memory that `to_json` wrote; None for one of another format or that cannot be read."""
        if document.get("format") != FORMAT:
            return None
        try:
            return cls(
                camera_from_json(document["origin"]),
                Epoch.from_json(document["anchor"]),
                None if document["recent"] is None else Epoch.from_json(document["recent"]),
                tuple(Epoch.from_json(epoch) for epoch in document["earlier"]),
                tuple(document["aside"]),
                document["lines"],
                document["frames"],
            )
        except (KeyError, TypeError, ValueError):
            # A camera without its memory can still be calibrated, and begins another one.
            return None


def fingerprint(lines: LinePoints) -> str:
    """Return a digest of the line points that a memory is about: another field has another one."""
    return hashlib.sha256(np.round(lines.position[~lines.end_to_end], 4).tobytes()).hexdigest()[:16]


def fingerprint_of_frames(frames: Sequence[Frame]) -> str:
    """Return a digest of a job's frames by every eighth row and column: no two nights have the same noise."""
    digest = hashlib.blake2b(digest_size=8)
    for frame in frames:
        digest.update(np.ascontiguousarray(frame[::8, ::8]).tobytes())
    return digest.hexdigest()


def memories_of_field(memories: Sequence[CameraMemory | None], lines: LinePoints) -> list[CameraMemory | None]:
    """Return the memories that are about these line points, None in place of any other."""
    here = fingerprint(lines)
    return [memory if memory is not None and memory.lines == here else None for memory in memories]
