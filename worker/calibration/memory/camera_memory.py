"""The memory of a camera: what it was told to be, its first nights, its last ones, and how it looked before.

The anchor does not follow: a lens that creeps by a hair a night is compared with what it was in the first nights, and
not with what it was yesterday. Only accepted jobs are remembered.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.memory.epoch import Epoch, camera_from_json, camera_to_json
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import LinePoints
from worker.calibration.see.line_measurement import Measurements

FORMAT = 1
ANCHOR_JOBS = 8
"""Jobs that make up the anchor."""
MOST_EARLIER, FEWEST_JOBS = 2, 4
"""Earlier epochs that are kept, of so many jobs at least: another way of looking tells lens and ground apart."""
REPAINTED_M, REPAINTED_PX = 0.025, 0.5
"""A marking of which half the points lie farther than both from where they were has been painted anew ..."""
FEWEST_REPAINTED, MOST_REPAINTED = 8, 0.34
"""... if so many of its points say so, and if no larger part of all markings has: else it is not the paint."""


@dataclass(frozen=True)
class CameraMemory:
    """`origin`: the camera as it was stored before its first job; `anchor`: the first jobs, `recent`: those since, and
    `earlier` ones that looked another way or had another lens; `lines`: the fingerprint of the field's line points.
    """

    origin: Camera
    anchor: Epoch
    recent: Epoch | None
    earlier: tuple[Epoch, ...]
    lines: str

    @classmethod
    def begun(
        cls, stored: Camera, found: Camera, measured: Measurements, lines: LinePoints, at: datetime | None
    ) -> CameraMemory:
        """The memory of the first accepted job, which found a camera that was `stored` before."""
        return cls(stored, Epoch.begun(found, measured, lines, at), None, (), fingerprint(lines))

    def after(self, found: Camera, measured: Measurements, lines: LinePoints, at: datetime | None) -> CameraMemory:
        """The memory with one more accepted job."""
        repainted = self.repainted(found, measured, lines)
        kept = self if len(repainted) == 0 else self.without(np.flatnonzero(np.isin(lines.marking, repainted)))
        job = (found, measured, lines, at)
        if kept.recent is None and kept.anchor.jobs < ANCHOR_JOBS and kept.anchor.looks_like(found, lines):
            return replace(kept, anchor=kept.anchor.joined(*job))
        if kept.recent is None:
            return replace(kept, recent=Epoch.begun(*job))
        if kept.recent.looks_like(found, lines):
            return replace(kept, recent=kept.recent.joined(*job))
        before = [*kept.earlier, kept.recent] if kept.recent.jobs >= FEWEST_JOBS else list(kept.earlier)
        return replace(kept, recent=Epoch.begun(*job), earlier=tuple(before[-MOST_EARLIER:]))

    @property
    def epochs(self) -> list[Epoch]:
        """All of them: the anchor, the recent one if there is one, and earlier ones."""
        return [self.anchor, *([self.recent] if self.recent else []), *self.earlier]

    @property
    def jobs(self) -> int:
        """Of how many accepted jobs it is."""
        return sum(epoch.jobs for epoch in self.epochs)

    @property
    def since(self) -> datetime | None:
        """When the first of them was."""
        return self.anchor.first

    def without(self, gone: NDArray[np.intp]) -> CameraMemory:
        """The memory without some line points."""
        return replace(
            self,
            anchor=self.anchor.without(gone),
            recent=self.recent and self.recent.without(gone),
            earlier=tuple(epoch.without(gone) for epoch in self.earlier),
        )

    def repainted(self, found: Camera, measured: Measurements, lines: LinePoints) -> NDArray[np.intp]:
        """The markings whose paint lies elsewhere than the last epoch saw it."""
        last = self.recent or self.anchor
        before, which, old = np.intersect1d(measured.index, last.index, return_indices=True)
        tonight = measured.offset(found, lines.position[measured.index])[which]
        apart_px = tonight - last.offset[old]
        scale = measured.px_per_metre[which]
        marking = lines.marking[before]
        limit_px = REPAINTED_PX * found.intrinsics.relative_size
        told = {
            number: (np.median(np.abs(apart_px[its])), np.median(np.abs(apart_px[its] / scale[its])))
            for number in np.unique(marking)
            if (its := np.flatnonzero(marking == number)).size >= FEWEST_REPAINTED
        }
        new = [number for number, (px, metres) in told.items() if px > limit_px and metres > REPAINTED_M]
        return np.array(new if len(new) <= MOST_REPAINTED * len(told) else [], dtype=np.intp)

    def to_json(self) -> dict[str, Any]:
        """The memory as a JSON object, about 10 kB an epoch."""
        return {
            "format": FORMAT,
            "lines": self.lines,
            "origin": camera_to_json(self.origin),
            "anchor": self.anchor.to_json(),
            "recent": None if self.recent is None else self.recent.to_json(),
            "earlier": [epoch.to_json() for epoch in self.earlier],
        }

    @classmethod
    def from_json(cls, told: Mapping[str, Any]) -> CameraMemory | None:
        """What `to_json` wrote; None for what another release wrote otherwise."""
        if told.get("format") != FORMAT:
            return None
        return cls(
            camera_from_json(told["origin"]),
            Epoch.from_json(told["anchor"]),
            None if told["recent"] is None else Epoch.from_json(told["recent"]),
            tuple(Epoch.from_json(epoch) for epoch in told["earlier"]),
            told["lines"],
        )


def fingerprint(lines: LinePoints) -> str:
    """Names the line points that the numbers of a memory are about: another field has another one."""
    return hashlib.sha256(np.round(lines.position, 4).tobytes()).hexdigest()[:16]


def fitting(memories: Sequence[CameraMemory | None], lines: LinePoints) -> list[CameraMemory | None]:
    """The memories that are about these line points, None in place of any other."""
    here = fingerprint(lines)
    return [memory if memory is not None and memory.lines == here else None for memory in memories]
