"""Measured lines without pictures: what the finish would read of cameras that are known to the last digit.

The lines are where a field puts them whose ground swells and whose paint lies a little beside itself, the same in all
nights; each night adds noise of its own. It takes a hundredth of the time that rendering takes, so that sequences of
hundreds of nights can be tried; what pictures add to it, the part with rendered frames says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.detection.view_condition import ViewCondition, ViewFigures
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.quality import CameraResult, Moved, alone_rejection
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory, memories_of_field
from worker.calibration.refinement.refine import refine
from worker.calibration.refinement.uncertainty import RefinedPoses

NOISE_PX, SHARED_PX = 0.2, 0.06
"""Error of a measurement, and the part of it that is the same every night."""
SWELL, ROUGH, PAINT_M = 12 / 15, 4 / 15, 0.005
"""Of the ground, parts of how uneven it usually is in that sport, and of the paint."""
CHANCE = 0.04
FOUND_PX = 3.0
USABLE = ViewCondition(True, None, None, "", ViewFigures(*[1.0] * len(ViewFigures.__dataclass_fields__)))


@dataclass
class Painted:
    """A field as it is really painted: `lines` (N points) where a plan has them, and `there` (N, 3), where they are."""

    pitch: Field
    lines: LinePoints
    there: np.ndarray

    @classmethod
    def drawn(cls, pitch: Field, rng: np.random.Generator) -> Painted:
        """On a ground that swells, by a painter who is half a centimetre off."""
        lines = pitch.measured_points
        ground = Ground.under(lines)
        swell = (
            SWELL * lines.uneven_m * np.linalg.cholesky(np.linalg.inv(ground.precision)) @ rng.normal(size=len(ground))
        )
        up = ground.under_points(swell, np.arange(len(lines))) + ROUGH * lines.uneven_m * rng.normal(size=len(lines))
        beside = PAINT_M * rng.normal(size=len(lines))
        there = lines.position + beside[:, None] * lines.normal + up[:, None] * [0.0, 0.0, 1.0]
        return cls(pitch, lines, there)

    def longest_seen(self, camera: Camera) -> str:
        """The marking of which a camera sees most."""
        seen = VisibleLines.from_camera(self.lines, camera)
        return self.pitch.markings()[int(np.argmax(np.bincount(seen.points.marking)))].name

    def painted_anew(self, name: str, aside_m: float) -> Painted:
        """Return the field with one marking so far aside."""
        number = [marking.name for marking in self.pitch.markings()].index(name)
        its = (self.lines.marking == number) & ~self.lines.end_to_end
        return replace(self, there=self.there + its[:, None] * aside_m * self.lines.normal)


@dataclass
class SimulatedSight:
    """Measurements of one night: `real` cameras before a painted field. `noise` (C, N) px along normals."""

    painted: Painted
    real: Sequence[Camera]
    noise: np.ndarray

    @classmethod
    def of_night(cls, painted: Painted, real: Sequence[Camera], shared: np.ndarray, rng: np.random.Generator):
        """One night; `shared` (C, N) px: the errors that are the same every night."""
        return cls(painted, real, shared + np.sqrt(NOISE_PX**2 - SHARED_PX**2) * rng.normal(size=shared.shape))

    def of(self, numbers: Sequence[int]) -> SimulatedSight:
        """Return the sight of some of the cameras."""
        return SimulatedSight(self.painted, [self.real[n] for n in numbers], self.noise[list(numbers)])

    def reader(self) -> SimulatedSight:
        """Return what measures the lines in it."""
        return self

    def read_anew(self) -> None:
        """Do nothing: there is no frame to read."""

    def measure(self, lines: LinePoints, cameras: Sequence[Camera], search_px: float) -> list[Measurements]:
        """The lines within `search_px` of where each camera expects them."""
        return [self._measured(lines, number, camera, search_px) for number, camera in enumerate(cameras)]

    def _measured(self, lines: LinePoints, number: int, camera: Camera, search_px: float) -> Measurements:
        seen = VisibleLines.from_camera(lines, camera)
        there = self.real[number].project(self.painted.there[seen.index])
        shift = np.sum((there - seen.pixel) * seen.normal, axis=1) + self.noise[number, seen.index]
        near = np.abs(shift) <= search_px * camera.intrinsics.relative_size
        seen, shift = seen[near], shift[near]
        pixel = seen.pixel + shift[:, None] * seen.normal
        sizes = (seen.px_per_metre, seen.px_per_metre_up, seen.length_px)
        return Measurements(seen.index, seen.points, pixel, seen.normal, *sizes, np.ones(len(seen)))

    def evidence(self, _pitch: Field, lines: LinePoints, cameras: Sequence[Camera]) -> list[Evidence]:
        """Lines are found where they are."""
        return [self._evidence(lines, number, camera) for number, camera in enumerate(cameras)]

    def _evidence(self, lines: LinePoints, number: int, camera: Camera) -> Evidence:
        seen = VisibleLines.from_camera(lines, camera)
        near = self._measured(lines, number, camera, FOUND_PX).index
        weight = seen.length_px * np.minimum(seen.width_px, 1.0)
        found = np.isin(seen.index, near)
        return Evidence(seen.index, seen.points.marking, weight, found, np.full(len(seen), CHANCE))


@dataclass
class Installation:
    """Cameras calibrated night after night: their `stored` poses and lenses, and what is remembered of each."""

    pitch: Field
    stored: list[Camera]
    memories: list[CameraMemory | None] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.memories = self.memories or [None] * len(self.stored)

    def night(self, sight: SimulatedSight, begun: Sequence[Camera] | None = None) -> list[CameraResult]:
        """One job: what is accepted is stored and remembered. `begun`: where a search left the cameras, if there was
        one."""
        finished = refine(self.pitch, begun or self.stored, sight, 0.5, stored=self.stored, memories=self.memories)
        results = self._judged(finished, sight)
        for number, result in enumerate(results):
            if not result.accepted:
                continue
            lines = self.pitch.measured_points
            frames = str(sight.noise[number].sum())
            job = AcceptedJob(
                result.camera,
                result.measured,
                lines,
                None,
                result.repainted_markings,
                frames,
                zoomed=result.lens_changed,
            )
            (memory,) = memories_of_field([self.memories[number]], lines)
            self.memories[number] = (
                CameraMemory.from_first_job(self.stored[number], job) if memory is None else memory.after(job)
            )
            self.stored[number] = result.camera
        return results

    def _judged(self, finished: RefinedPoses, sight: SimulatedSight) -> list[CameraResult]:
        before = sight.evidence(self.pitch, self.pitch.line_points(), self.stored)
        results = [
            CameraResult(
                **vars(after),
                view=USABLE,
                overlap=Overlap(1.0, 1.0, 0.0),
                evidence_before=partial(replace, was),
                moved=Moved.between(self.pitch, stored, after.camera),
                moved_in_all=memory and Moved.between(self.pitch, memory.origin, after.camera),
            )
            for stored, after, was, memory in zip(self.stored, finished.each, before, self.memories, strict=True)
        ]
        return [replace(result, refusal=alone_rejection(result)) for result in results]
