"""The joint verdict: cameras that passed the gate, judged against each other."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from worker.calibration.detection.evidence import Evidence
from worker.calibration.diagnostics.seam import measure_seam
from worker.calibration.gate.pairs import (
    CameraResponse,
    Pair,
    compare_pairs,
    compare_pairs_before,
    find_contradictions,
    measured_by_lines,
    refusal_by_pairs,
    stitch_error_of,
)
from worker.calibration.gate.quality import CameraResult, in_one_sentence, ridge_rejection
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.problem import Problem
from worker.calibration.records import EngineResult, ProgressReporter
from worker.calibration.steps import ridges_of


def judge_together(
    problem: Problem, pitch: Field, results: Sequence[CameraResult], progress: ProgressReporter
) -> EngineResult:
    """Judge against each other cameras that were judged by themselves, on the `pitch` they were refined with."""
    with progress.timed("quality"):
        progress.at("refinement", 0.6)
        pairs = _compare(problem, pitch, results)
    against = find_contradictions(pairs) if any(result.accepted for result in results) else []
    ridge = ridge_rejection(pitch)
    reasons = [f"camera {one.camera.id}: {one.rejected_because}" for one in results if one.rejected_because]
    reasons += [one.words() for one in against]
    reasons += [ridge.words] if ridge else []
    judged = [
        replace(result, refusal=result.refusal or refusal_by_pairs(result.camera.id, against) or ridge)
        for result in results
    ]
    stitch = stitch_error_of(pairs, judged)
    by_id = {result.camera.id: result for result in judged}
    seams = [(pair, measure_seam(pitch, by_id[pair.first], by_id[pair.second])) for pair in pairs]
    return EngineResult(pitch, judged, in_one_sentence(reasons) or None, stitch, progress.timings, pairs=seams)


def _comparable(results: Sequence[CameraResult]) -> list[int]:
    """Return the indices of the cameras to compare: the accepted ones, or without any, those with usable views."""
    accepted = [n for n, result in enumerate(results) if result.accepted]
    return accepted or [n for n, result in enumerate(results) if result.view.usable]


def _compare(problem: Problem, pitch: Field, results: Sequence[CameraResult]) -> list[Pair]:
    """Compare pairs of cameras by the network's responses or, where it has not looked in full, by measured lines.

    By ridges if these do not register what should be. How far those are apart that agree is measured by lines.
    """
    chosen = _comparable(results)
    seeing = [
        _response_of(problem, n, results[n].camera, partial(_evidence_of, results[n]), results[n]) for n in chosen
    ]
    pairs = compare_pairs(pitch, seeing)
    nothing = bool(pairs) and all(pair.error_px is None for pair in pairs)
    if nothing or any(pair.missed for pair in pairs):
        channels = problem.observed.observations.channels
        ridges = [ridges_of(pitch, results[n].camera, channels[n]) for n in chosen]
        by_ridges = compare_pairs(pitch, [replace(one, response=its) for one, its in zip(seeing, ridges, strict=True)])
        pairs = [again if pair.error_px is None else pair for pair, again in zip(pairs, by_ridges, strict=True)]
    return measured_by_lines(pitch, pairs, seeing)


def _evidence_of(result: CameraResult) -> Evidence:
    return result.evidence


def _response_of(
    problem: Problem, number: int, camera: Camera, evidence: Callable[[], Evidence], result: CameraResult
) -> CameraResponse:
    """Return what is compared of camera `number` when it stands as `camera` does."""
    response = problem.observed.observations.responses[number] if number in problem.observed.in_full else None
    return CameraResponse(camera, response, evidence, result.measured)


def compare_stored(problem: Problem, judged: EngineResult) -> list[Pair]:
    """Compare pairs by their stored poses: of accepted poses, as seen from where those put the views."""
    cameras = problem.cameras
    stored = {
        camera.id: _response_of(problem, n, camera, result.evidence_before, result)
        for n, (camera, result) in enumerate(zip(cameras, judged.cameras, strict=True))
    }
    if any(result.accepted for result in judged.cameras):
        found = {result.camera.id: result.camera for result in judged.cameras}
        return compare_pairs_before(problem.pitch, stored, found, [pair for pair, _ in judged.pairs])
    return compare_pairs(problem.pitch, [stored[cameras[n].id] for n in _comparable(judged.cameras)])
