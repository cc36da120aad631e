"""From stored poses to where the cameras stand: search and finish, in which a bad camera drags no other along.

All cameras whose frames can be used are searched for and finished together. Who then does not pass the gate is tried on
its own. If it passes there, the others get it back once, from where it has found to; if not, or not even then, it
stands by itself, and the others finish as if it did not exist.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import cv2
import numpy as np

from worker.calibration.finish.refinement import LineReader, Sight, assess, refine
from worker.calibration.finish.uncertainty import Deviation, Finished
from worker.calibration.judge.markings import markings_seen
from worker.calibration.judge.overlap import overlap_of
from worker.calibration.judge.quality import CameraResult, Gate, Movement, alone_rejection
from worker.calibration.judge.registration import Response
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.records import Journey, Options, Preset
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.calibration.scene.parameters import Parameter, free_focal_lengths, free_ridge
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.search.genome import genome_of
from worker.calibration.search.search import (
    ALONE_ON_THE_GROUND,
    COARSE_TO_FINE,
    ON_THE_GROUND,
    Found,
    Level,
    Strategy,
    search,
)
from worker.calibration.see.contrast import Channels
from worker.calibration.see.evidence import evidence_of
from worker.calibration.see.left_out import left_out, of_use
from worker.calibration.see.ridge_response import ridge_response
from worker.calibration.see.view import ViewCondition

CAPTURE_RAD = 0.1
"""How far a line may be from where the stored pose expects it: 4 degrees of rotation and 0.3 m at 15 m."""
NOBODY: Mapping[int, Camera] = MappingProxyType({})


@dataclass(frozen=True)
class Method:
    """What a preset does: the levels of its search, the shape of the ground, and how it ends.

    `power`: of the network's responses in the search, so that what it half believes (the edge of a shadow, a board)
    hardly pulls; `tries_again`: whether a camera that does not pass the gate is tried on its own.
    """

    levels: Sequence[Level]
    flat: bool
    power: int
    tries_again: bool
    finish: Callable[..., Finished]


METHODS: Mapping[Preset, Method] = {
    "esc": Method(COARSE_TO_FINE, flat=False, power=3, tries_again=True, finish=refine),
    "paper": Method(ON_THE_GROUND, flat=False, power=1, tries_again=False, finish=assess),
    "scpr": Method(ALONE_ON_THE_GROUND, flat=True, power=1, tries_again=False, finish=assess),
}
"""`esc`: the default. `paper`: the paper's own objective. `scpr`: its predecessor, flat and without a stitch term."""


@dataclass(frozen=True)
class Seen:
    """What the cameras see: `views`, whether their frames can be used, and the `sight` of the search and the finish."""

    views: Sequence[ViewCondition]
    sight: Sight

    def of(self, numbers: Sequence[int]) -> Seen:
        """What some of them see."""
        return Seen([self.views[n] for n in numbers], self.sight.of(numbers))


@dataclass(frozen=True)
class Situation:
    """Cameras at their stored poses around a pitch, what they see, how they are to be found, and their memories."""

    method: Method
    pitch: Field
    cameras: Sequence[Camera]
    seen: Seen
    options: Options
    journey: Journey
    memories: Sequence[CameraMemory | None]
    gate: Gate = field(default_factory=Gate)

    def of(self, numbers: Sequence[int]) -> Situation:
        """That of some of the cameras."""
        cameras, memories = [self.cameras[n] for n in numbers], [self.memories[n] for n in numbers]
        return replace(self, cameras=cameras, seen=self.seen.of(numbers), memories=memories)

    def by_itself(self, number: int) -> Situation:
        """That of one camera, which has no say in what all of them stand on."""
        ridge = self.options.fit_ridge and len(self.cameras) == 1
        return replace(self.of([number]), options=replace(self.options, fit_ridge=ridge))

    @property
    def usable(self) -> list[int]:
        """The cameras whose frames can be used."""
        return [n for n, view in enumerate(self.seen.views) if view.usable]

    def searched(self, responses: Sequence[Response]) -> Found:
        """Where the search leads from the stored poses."""
        asked = self.options
        strategy = Strategy(asked.parents, asked.offspring, asked.generations, asked.stitch_weight)
        with self.journey.measuring("evolution"):
            rng = np.random.default_rng(asked.seed)
            on_generation = self.journey.evolution(asked.generations)
            return search(self.pitch, self.cameras, responses, self.method.levels, strategy, rng, on_generation)

    def by_network(self) -> list[Response]:
        """What the search follows: what the network sees."""
        seen = self.seen.sight.responses
        return [np.asarray(cv2.pow(response, self.method.power), dtype=np.float32) for response in seen]

    def by_ridges(self) -> list[Response]:
        """What it follows where that leads nowhere."""
        channels = self.seen.sight.channels
        return [ridges_of(self.pitch, camera, its) for camera, its in zip(self.cameras, channels, strict=True)]

    def finished(self, begun: Sequence[Camera]) -> Finished:
        """Where the finish leaves cameras that the search has left where they have `begun`."""
        with self.journey.measuring("refinement"):
            self.journey.at("refinement", 0.0)
            asked = self.options
            return self.method.finish(
                self.pitch,
                begun,
                self.seen.sight,
                asked.stitch_weight,
                self._free(),
                stored=self.cameras,
                memories=self.memories,
            )

    def finished_nearby(self, reader: LineReader) -> Finished:
        """Where the finish leaves cameras that begin at their stored poses, around which the `reader` has measured."""
        with self.journey.measuring("refinement"):
            self.journey.at("refinement", 0.0)
            return refine(
                self.pitch,
                self.cameras,
                self.seen.sight,
                self.options.stitch_weight,
                self._free(),
                memories=self.memories,
                reader=reader,
            )

    def loss_of(self, pitch: Field, answered: Sequence[Camera]) -> float:
        """The loss of the search's middle level where the cameras are answered to stand, inf without any of use.

        A finer one looks at larger pictures, which takes a third of a second to say hardly more.
        """
        group = self.usable
        if not group:
            return float("inf")
        cameras = [answered[n] for n in group]
        seen = [
            response if (out := left_out(pitch, camera)) is None else np.where(out, np.float32(0), response)
            for camera, response in zip(cameras, self.of(group).by_network(), strict=True)
        ]
        level = self.method.levels[len(self.method.levels) // 2]
        together = level.objective(pitch, cameras, seen, 0.0 if level.alone else self.options.stitch_weight)
        return float(together.losses(genome_of(cameras)[None])[0])

    def left(self) -> Finished:
        """The stored poses as they are."""
        with self.journey.measuring("refinement"):
            weight = self.options.stitch_weight
            return assess(self.pitch, self.cameras, self.seen.sight, weight, self._free(), memories=self.memories)

    def judged(self, finished: Finished) -> list[CameraResult]:
        """What each of them is worth by itself, beside its stored pose."""
        with self.journey.measuring("quality"):
            return judged_alone(self.pitch, self.cameras, self.memories, self.seen, finished, self.gate)

    def _free(self) -> list[Parameter]:
        """What is to be found along with the poses."""
        lengths = free_focal_lengths(self.cameras) if self.options.fit_focal_length else []
        return [*lengths, *(free_ridge(self.pitch) if self.options.fit_ridge else [])]


@dataclass(frozen=True)
class Settled:
    """Where the cameras ended on their pitch, each judged by itself.

    `begun`: where the search left each; `together`: the numbers of those that were finished together, the others stand
    by themselves; `deviations`: what the lines say of lenses and field; `generations`: of the search of all.
    """

    pitch: Field
    begun: list[Camera]
    results: list[CameraResult]
    together: list[int]
    deviations: list[Deviation]
    generations: int


def settle(here: Situation, near: Mapping[int, Camera] = NOBODY) -> Settled:
    """Search for all cameras that can be used but those found `near` their stored poses, and finish; see the module."""
    together = here.usable
    lost = [n for n in together if n not in near]
    first = here.of(lost)
    found = first.searched(first.by_network()) if lost else Found([], np.inf, 0)
    begun = [near.get(n, camera) for n, camera in enumerate(here.cameras)]
    for n, camera in zip(lost, found.cameras, strict=True):
        begun[n] = camera
    everyone = range(len(begun))
    alone = {n: left_alone(here.of([n])) for n in everyone if n not in together}
    results = {n: attempt.result for n, attempt in alone.items()}
    finished = Finished(here.pitch, [], [], [])
    while together:
        group = here.of(together)
        finished = group.finished([begun[n] for n in together])
        results |= zip(together, group.judged(finished), strict=True)
        failing = [n for n in together if not results[n].accepted]
        if not (failing and here.method.tries_again):
            break
        for n in failing:
            tried_before = n in alone
            if not tried_before:
                alone[n] = _tried_alone(here.by_itself(n), begun[n])
                begun[n] = alone[n].begun
            if tried_before or not alone[n].result.accepted:
                together = [other for other in together if other != n]
                results[n] = alone[n].result
    deviations = _deviations(finished, [alone[n].finished for n in everyone if n not in together])
    in_order = [results[n] for n in everyone]
    return Settled(finished.pitch, begun, in_order, together, deviations, found.generations)


def settle_without(out: Collection[int], here: Situation, settled: Settled) -> Settled:
    """The same, but some of those that were finished together stay as they are, and the others finish without them."""
    together = [n for n in settled.together if n not in out]
    if len(together) in (0, len(settled.together)):
        return replace(settled, together=together)
    group = here.of(together)
    finished = group.finished([settled.begun[n] for n in together])
    results = dict(enumerate(settled.results)) | dict(zip(together, group.judged(finished), strict=True))
    theirs = {here.cameras[n].id for n in together}
    of_others = [d for d in settled.deviations if d.camera is not None and d.camera not in theirs]
    return replace(
        settled,
        pitch=finished.pitch,
        results=list(results.values()),
        together=together,
        deviations=finished.deviations + of_others,
    )


def _deviations(together: Finished, apart: Sequence[Finished]) -> list[Deviation]:
    """What lines say of lenses and field: of a camera that stands apart its own, of the field those of the others."""
    of_their_own = [deviation for one in apart for deviation in one.deviations if deviation.camera is not None]
    theirs = {deviation.camera for deviation in of_their_own}
    return [deviation for deviation in together.deviations if deviation.camera not in theirs] + of_their_own


@dataclass(frozen=True)
class Attempt:
    """What a camera by itself comes to from where it has `begun`."""

    begun: Camera
    finished: Finished
    result: CameraResult

    @property
    def agreement(self) -> float:
        """How much of its lines it then sees."""
        return self.result.evidence.agreement


def _tried_alone(here: Situation, found: Camera) -> Attempt:
    """The best that a camera by itself comes to: from where all have `found` it, and else from elsewhere."""
    best = _attempt(here, found)
    for start in _other_starts(here, lost=best.agreement < here.gate.least_agreement):
        if best.result.accepted:
            break
        best = max(best, _attempt(here, start), key=lambda attempt: attempt.agreement)
    return best


def _other_starts(here: Situation, *, lost: bool) -> Iterator[Camera]:
    """Where ridges lead a camera that is lost, and its stored pose."""
    if lost:
        yield here.searched(here.by_ridges()).cameras[0]
    yield here.cameras[0]


def _attempt(here: Situation, begun: Camera) -> Attempt:
    finished = here.finished([begun])
    return Attempt(begun, finished, here.judged(finished)[0])


def left_alone(here: Situation) -> Attempt:
    """A camera whose frame cannot be used."""
    finished = here.left()
    return Attempt(here.cameras[0], finished, here.judged(finished)[0])


def judged_alone(
    pitch: Field,
    stored: Sequence[Camera],
    memories: Sequence[CameraMemory | None],
    seen: Seen,
    finished: Finished,
    gate: Gate,
) -> list[CameraResult]:
    """What each finished camera is worth by itself beside the `stored` one on the `pitch` it was stored for."""
    lines = pitch.line_points()
    results = [
        CameraResult(
            **vars(after),
            view=view,
            overlap=overlap_of(finished.pitch, after.camera, response),
            evidence_before=evidence_of(lines, before, channels, response, left_out(pitch, before)),
            moved=Movement.between(pitch, before, after.camera),
            markings=markings_seen(finished.pitch, after, channels, response),
            moved_in_all=None if memory is None else Movement.between(pitch, memory.origin, after.camera),
        )
        for before, memory, after, view, channels, response in zip(
            stored, memories, finished.each, seen.views, seen.sight.channels, seen.sight.responses, strict=True
        )
    ]
    return [replace(result, refusal=alone_rejection(result, gate)) for result in results]


def ridges_of(pitch: Field, camera: Camera, channels: Channels) -> Response:
    """What streaks say (H, W) of where the markings are, wherever the network would look for them."""
    lines = SeenLines.from_camera(pitch.line_points(), camera)
    return of_use(camera, ridge_response(channels, lines, CAPTURE_RAD * camera.intrinsics.focal_length_px))
