"""Baselines: each answers a case, moment by moment, and sees no truth but where that is said."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.fccb.sets import Answer, CameraAnswer, Case, CaseSet, MomentAnswer
from benchmarks.learned.pose import Displacement, corrected, posed_by
from benchmarks.learned.weights import missing
from models import MODEL_PATH
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import Segmenter, whole_frame
from worker.calibration.find_cameras import find_cameras
from worker.calibration.geometry.camera import Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.paper.calibrate import PRESETS, calibrate_by_paper
from worker.calibration.records import Calibration, CalibrationError, Options
from worker.jobs.find import sought_camera
from worker.jobs.to_schemas import sigma_to_schema

THREADS = 2
CLICK_NOISE_PX = 2.0
FEWEST_CLICKS = 4
Frames = Mapping[str, Sequence[Frame]]


@dataclass(frozen=True)
class Question:
    """A case, and where it lies."""

    cases: CaseSet
    name: str
    case: Case

    def frames(self) -> Iterator[Frames]:
        """Yield the frames of each moment."""
        for moment in range(len(self.case.moments)):
            yield self.case.frames(self.cases.case_folder(self.name), moment)


Moments = Iterator[list[CameraAnswer]]
Method = Callable[[Question], Moments]


@cache
def segmenter() -> Segmenter:
    """Return the network."""
    return Segmenter(MODEL_PATH, THREADS)


def esc(question: Question) -> Moments:
    """Answer as the service does: poses and memories of accepted nights are where the next one begins."""
    return _found(question) if question.case.task == "find" else _calibrated(question, calibrate)


def _found(question: Question) -> Moments:
    for frames in question.frames():
        sought = [
            sought_camera(one, (frames[one.id][0].shape[1], frames[one.id][0].shape[0]))
            for one in question.case.site.cameras
        ]
        found = find_cameras(question.case.pitch, sought, [], frames, segmenter(), 0)
        yield [
            CameraAnswer.of(
                one.candidates[0].camera, accepted=one.accepted, sigma=sigma_to_schema(one.candidates[0].sigma)
            )
            for one in found.cameras
            if one.candidates
        ]


def _calibrated(question: Question, method: Callable[..., Calibration]) -> Moments:
    cameras = question.case.cameras
    memories: Mapping[str, CameraMemory] = {}
    for frames in question.frames():
        try:
            said = method(question.case.pitch, cameras, frames, segmenter(), Options(), memories=memories)
        except CalibrationError:
            yield []
            continue
        yield [
            CameraAnswer.of(one.camera, accepted=one.accepted, sigma=sigma_to_schema(one.sigma)) for one in said.cameras
        ]
        memories = {**memories, **said.memories}
        poses = {one.camera.id: one.camera.pose for one in said.cameras if one.accepted}
        cameras = [camera.with_pose(poses.get(camera.id, camera.pose)) for camera in cameras]


def paper(question: Question) -> Moments:
    """Answer by the method of the ESC paper, with the gate of the product."""

    def method(*arguments: object, memories: object) -> Calibration:
        return calibrate_by_paper(PRESETS["paper"], *arguments)

    return _calibrated(question, method)


def stored(question: Question) -> Moments:
    """Answer that nothing has moved."""
    for _ in question.case.moments:
        yield [CameraAnswer.of(camera, accepted=True) for camera in question.case.cameras]


def clicked(question: Question) -> Moments:
    """Answer with OpenCV's pose of the ends of markings that somebody clicks on within 2 px: it sees the truth."""
    truth = question.cases.truth(question.name)
    rng = np.random.default_rng(0)
    for moment in truth.moments:
        answers = []
        for camera, real in zip(question.case.cameras, moment, strict=True):
            points, pixels = _clicks(question.case.pitch, real.posed, rng)
            if real.shows_field and len(points) >= FEWEST_CLICKS:
                answers.append(CameraAnswer.of(posed_by(camera, points, pixels), accepted=True))
        yield answers


def _clicks(pitch: Field, real: Camera, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of open markings that are in view (K, 3), and where somebody clicks on them (K, 2)."""
    ends = [marking.centre[n] for marking in pitch.markings() if not marking.closed for n in (0, -1)]
    points = pitch.lift(np.unique(np.round(ends, 6), axis=0))
    pixels = real.project(points)
    seen = inside(pixels, real.intrinsics.size)
    return points[seen], pixels[seen] + rng.normal(0, CLICK_NOISE_PX, (int(seen.sum()), 2))


def by_homography(displacement: Callable[[], Displacement], question: Question) -> Moments:
    """Answer by laying each segmentation, seen from above, onto the template; whatever comes out is accepted."""
    find = displacement()
    for frames in question.frames():
        yield [
            CameraAnswer.of(
                corrected(camera, question.case.pitch, _response(frames[camera.id][0]), find), accepted=True
            )
            for camera in question.case.cameras
        ]


def _response(frame: Frame) -> NDArray[np.float32]:
    """Return the network's response to a frame, (H, W) in 0..1."""
    height, width = frame.shape[:2]
    return segmenter()(frame, whole_frame((width, height))).astype(np.float32) / 255


def _ecc() -> Displacement:
    from benchmarks.learned.ecc import aligned

    return aligned


def _learned(name: str) -> Displacement:
    # PyTorch is in the extra `bench` alone.
    from benchmarks.learned.nets import displacement_by

    return displacement_by(name)


@dataclass(frozen=True)
class Baseline:
    """A method of the table; `weights`: nets that it needs; `finds`: whether it answers without a stored pose."""

    answer: Method
    weights: tuple[str, ...] = ()
    finds: bool = False

    def cannot_run(self) -> str | None:
        """Return why it cannot run now, in words; None where it can."""
        return missing(self.weights) if self.weights else None

    def answers(self, question: Question) -> Moments:
        """Answer a case; nothing is said of one that the method has no way for."""
        if question.case.task == "find" and not self.finds:
            return iter([[]])
        return self.answer(question)


BASELINES: Mapping[str, Baseline] = {
    "stored": Baseline(stored),
    "clicks": Baseline(clicked),
    "ecc": Baseline(partial(by_homography, _ecc)),
    "dhn": Baseline(partial(by_homography, partial(_learned, "dhn")), ("dhn",)),
    "otle": Baseline(partial(by_homography, partial(_learned, "otle")), ("dhn", "otle")),
    "ihn": Baseline(partial(by_homography, partial(_learned, "ihn")), ("ihn",)),
    "paper": Baseline(paper),
    "esc": Baseline(esc, finds=True),
}


def answer_all(cases: CaseSet, method: str, answers: Path) -> None:
    """Answer the cases of a set that have no answer yet."""
    answers.mkdir(parents=True, exist_ok=True)
    for name in cases.names:
        file = answers / f"{name}.json"
        if not file.exists():
            said = BASELINES[method].answers(Question(cases, name, cases.case(name)))
            moments = [MomentAnswer(cameras=cameras) for cameras in said]
            file.write_text(Answer(moments=moments).model_dump_json(indent=1, exclude_none=True))
            print(f"{method} {name}", flush=True)
