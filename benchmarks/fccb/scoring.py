"""Scores of answers: error, coverage of sigma, and verdict.

A pose is right if it puts the markings in view, in the mean, within 0.4 % of the picture's width of where they are.
An accepted right pose counts 1, a refused camera 0, an accepted wrong pose -10; the score of a task is 100 times the
mean over the frames that show the field. What is refused of the others costs nothing, and brings nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from benchmarks.fccb.sets import TASKS, Answer, Case, CaseSet, Task, TrueCamera
from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.geometry.field import Field
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import mean_shift_px, twin
from worker.jobs.from_schemas import pitch_of

RIGHT_SHARE_OF_WIDTH = 0.004
WRONG_COSTS = 10
SIGMAS = 3.0
UNSEEN_PX = 1e4
"""How far off a marking counts that the answered camera does not see."""


class AnswersError(Exception):
    """Raised when a folder of answers cannot be scored; it says which file, and what was expected of it."""


@dataclass(frozen=True)
class Verdict:
    """One camera at one moment; `error_m` of its position, and `sigma_m` of it, where the answer says one."""

    shows_field: bool
    accepted: bool
    is_right: bool
    error_m: float
    sigma_m: float | None

    @property
    def points(self) -> int:
        """What it counts."""
        if not self.accepted:
            return 0
        return int(self.shows_field) if self.is_right else -WRONG_COSTS


@dataclass(frozen=True)
class TaskScore:
    """Verdicts of a task, and between which centimetres the cameras of its rigs put common lines on the ground."""

    verdicts: Sequence[Verdict]
    stitch_cm: Sequence[float]

    @property
    def points(self) -> float:
        """Points of 100; none of a task without a frame that shows its field."""
        asked = sum(one.shows_field for one in self.verdicts)
        return 100 * sum(one.points for one in self.verdicts) / asked if asked else 0.0

    def row(self) -> str:
        """Return the columns of a table."""
        asked = [one for one in self.verdicts if one.shows_field]
        right = [one for one in asked if one.accepted and one.is_right]
        wrong = sum(one.accepted and not one.is_right for one in self.verdicts)
        covered = [one.error_m <= SIGMAS * one.sigma_m for one in right if one.sigma_m is not None]
        error = f"{100 * np.median([one.error_m for one in right]):.1f}" if right else "-"
        return (
            f"{self.points:.0f} | {len(right)} of {len(asked)} | {wrong} | {error} "
            f"| {f'{np.mean(covered):.0%} of {len(covered)}' if covered else '-'} "
            f"| {f'{np.median(self.stitch_cm):.1f}' if len(self.stitch_cm) else '-'}"
        )


COLUMNS = "score | right | accepted wrong | error, cm | within 3 sigma | stitch, cm"


def score(cases: CaseSet, answers: Path) -> dict[Task, TaskScore]:
    """Score all answers to a set; a case without one counts as refused. Raises `AnswersError`."""
    if not answers.is_dir():
        raise AnswersError(f"expected a folder of answers, got {answers}, which is none")
    named = {file.stem for file in answers.glob("*.json")}
    if named and not named & {*cases.names}:
        raise AnswersError(f"{answers} answers {min(named)} and others, and no case of {cases.folder}")
    judged: dict[Task, list[tuple[list[Verdict], list[float]]]] = {task: [] for task in TASKS}
    for name in cases.names:
        case = cases.case(name)
        judged[case.task].append(_judge(case, cases, name, _answer(case, answers / f"{name}.json")))
    return {
        task: TaskScore(
            [v for verdicts, _ in of_task for v in verdicts], [cm for _, stitch in of_task for cm in stitch]
        )
        for task, of_task in judged.items()
        if of_task
    }


def overall(scores: dict[Task, TaskScore]) -> float:
    """Return the mean of the tasks' points."""
    return float(np.mean([of_task.points for of_task in scores.values()]))


def _answer(case: Case, file: Path) -> Answer:
    """Read the answer to a case; one that is missing refuses it."""
    if not file.exists():
        return Answer(moments=[])
    try:
        answer = Answer.model_validate_json(file.read_text())
    except ValidationError as error:
        raise AnswersError(f"{file} is no answer: {error}") from error
    known = {one.id for one in case.site.cameras}
    for camera in (one.id for moment in answer.moments for one in moment.cameras):
        if camera not in known:
            raise AnswersError(f"{file} answers camera {camera}; the case has {', '.join(sorted(known))}")
    return answer


def _judge(case: Case, cases: CaseSet, name: str, answer: Answer) -> tuple[list[Verdict], list[float]]:
    truth = cases.truth(name)
    pitch = pitch_of(truth.field)
    markings = FieldMap.of(pitch)
    verdicts, stitch = [], []
    for moment, true in enumerate(truth.moments):
        said = {one.id: one for one in answer.moments[moment].cameras} if moment < len(answer.moments) else {}
        found = []
        for known, real in zip(case.site.cameras, true, strict=True):
            one = said.get(known.id)
            camera = None if one is None else one.posed(known, real.camera.image_size)
            accepted = camera is not None and one is not None and one.accepted
            sigma_m = None if one is None or one.sigma is None else one.sigma.position_m
            verdicts.append(_verdict(pitch, markings, real, camera, accepted, sigma_m))
            found.append(camera if accepted else None)
        stitch += list(_stitch_cm(pitch, [one.posed for one in true], found))
    return verdicts, stitch


def _verdict(
    pitch: Field, markings: FieldMap, real: TrueCamera, camera: Camera | None, accepted: bool, sigma_m: float | None
) -> Verdict:
    if camera is None:
        return Verdict(real.shows_field, False, False, np.inf, None)
    shift_px = mean_shift_px(pitch, markings, real.posed, camera, UNSEEN_PX)
    # Half a turn about the middle leaves most fields as they are: nothing in the frame says which side it is.
    same = [camera, twin(camera)] if markings.is_symmetric else [camera]
    error_m = min(real.posed.distance_m(one) for one in same)
    is_right = shift_px <= RIGHT_SHARE_OF_WIDTH * real.camera.image_size[0]
    return Verdict(real.shows_field, accepted, bool(is_right), error_m, sigma_m)


def _stitch_cm(pitch: Field, real: Sequence[Camera], found: Sequence[Camera | None]) -> Iterator[float]:
    """Yield how far apart (rms) two accepted cameras put what both see of the lines on flat ground."""
    for n, other in enumerate(found):
        for m, one in enumerate(found[:n]):
            if one is None or other is None:
                continue
            lines = pitch.line_points().position
            seen = [camera.project(lines) for camera in (real[m], real[n])]
            common = np.all([inside(px, camera.intrinsics.size) for px, camera in zip(seen, real, strict=True)], axis=0)
            if common.any():
                places = [_on_ground(camera, px[common]) for camera, px in zip((one, other), seen, strict=True)]
                yield 100 * float(np.sqrt(np.mean(np.sum((places[0] - places[1]) ** 2, axis=1))))


def _on_ground(camera: Camera, pixel: Array) -> Array:
    """Return where the rays of pixels (N, 2) meet z = 0, (N, 2)."""
    ray = camera.rays(pixel)
    return (camera.pose.position - ray * (camera.pose.position[2] / ray[:, 2:]))[:, :2]
