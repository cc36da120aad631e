"""The engine on one page: frames and stored poses in; new poses, verdicts and diagnostics out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.diagnostics.seam import measure_seam
from worker.calibration.gate.pairs import (
    CameraResponse,
    Pair,
    compare_pairs,
    compare_pairs_before,
    find_contradictions,
    measured_by_lines,
    refusal_by_pairs,
    stitch_error_px,
)
from worker.calibration.gate.quality import (
    MUCH_UNEXPECTED,
    CameraResult,
    Gate,
    credible_deviations,
    in_one_sentence,
    ridge_rejection,
)
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory, fingerprint_of_frames, memories_of_field
from worker.calibration.near_path import NearSolution, refine_by_lines
from worker.calibration.observe import NOTHING_USUAL, FrameObserver
from worker.calibration.paint_path import log_odds, show_paint_of_field
from worker.calibration.records import (
    NOT_RECORDED,
    Calibration,
    EngineResult,
    Options,
    Path,
    Progress,
    ProgressReporter,
    Recorder,
    Segment,
)
from worker.calibration.refinement.diagnosis import find_suspicions
from worker.calibration.solve import (
    PoseSolution,
    Problem,
    evidence_at,
    is_doubtful,
    loss_of,
    refine_without,
    ridges_of,
    with_unusable_cameras,
)
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.swapped_cameras import mark_swapped_frames
from worker.calibration.wide_path import NO_CAMERAS, search_and_refine, search_in_overviews
from worker.calibration.zoom_refit import refit_zoomed

if TYPE_CHECKING:
    from worker.calibration.recovery import Solved

NO_MEMORIES: Mapping[str, CameraMemory] = MappingProxyType({})


def calibrate(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    options: Options,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
    memories: Mapping[str, CameraMemory] = NO_MEMORIES,
    taken_at: datetime | None = None,
    recorder: Recorder = NOT_RECORDED,
) -> Calibration:
    """Find the poses of all cameras at once, and judge each.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics; `usual[camera.id]`: what the last accepted job saw there; `memories[camera.id]`: its earlier nights;
    `taken_at`: when the frames were taken; `recorder` receives what the stages saw, and changes nothing. Deterministic
    for `options.seed`, whatever the number of the network's threads. Raises `CalibrationError` when no stored pose sees
    markings, `Stopped` soon after `stop()` turns true.
    """
    # What is measured beside a field that is not the venue's is nothing to remember.
    flattened = pitch.ridge is not None and options.flat
    pitch = pitch.flat() if flattened else pitch
    progress = ProgressReporter(report, stop)

    # Observe.
    observer = FrameObserver.of(pitch, cameras, frames, segment)
    observed = observer.observe(progress, usual)
    known = [_of_other_frames(memories.get(camera.id), frames[camera.id]) for camera in cameras]
    problem = Problem(pitch, cameras, observed, options, known, recorder=recorder)

    # Solve and judge: where the cameras stood if all usable ones pass there, else by search and refinement.
    solved = _solve(problem, observer, progress)

    # Among the lines of several sports, look for those of one paint.
    solved, observer = _solve_in_paint(problem, solved, observer, progress)

    # Recover: search anywhere for cameras that do not stand where they stood.
    problem, solution, judged, path = _recover(solved, observer, progress)
    seen = [problem.observed.seen_by_network(n) for n in range(len(cameras))]
    recorder.observed(cameras, frames, problem.observed.views, seen)
    recorder.judged(judged.pitch, cameras, judged.cameras)

    # Diagnose, and remember.
    with progress.timed("quality"):
        loss = loss_of(problem, judged.pitch, [result.camera for result in judged.cameras])
    found = diagnose(problem, solution, judged, path, loss, frames, progress)
    return found if flattened else replace(found, memories=remember(judged, cameras, frames, memories, taken_at))


def _of_other_frames(memory: CameraMemory | None, frames: Sequence[Frame]) -> CameraMemory | None:
    """Return a memory, or None where these frames are all that it holds: sent again they say nothing new."""
    if memory is None or memory.jobs > 1:
        return memory
    return None if memory.frames == fingerprint_of_frames(frames) else memory


def _solve(problem: Problem, observer: FrameObserver, progress: ProgressReporter) -> Solved:
    """Solve for the poses and judge them; return the problem with all that the network was asked for on the way.

    Lines are asked first, where the cameras stood and then around it, and the network looks in full where they do not
    suffice. Only cameras that are not near their stored poses are searched for.
    """
    everyone = range(len(problem.cameras))
    problem = observer.with_overviews(problem, progress)

    # Where the cameras stood.
    near = refine_by_lines(problem, progress) if problem.options.search == "auto" else None
    solved = _judged_together(problem, _near_solution(problem, near, progress), progress)
    if solved is not None:
        return problem, *solved, "near"

    # Around it, by overviews. Cameras that are all near contradict each other: none of them is known to be right.
    if near is None or near.numbers == problem.usable:
        near, lost = None, list(everyone)
    else:
        lost = [n for n in everyone if n not in near.numbers]
    problem = replace(problem, observed=mark_swapped_frames(problem, lost, observer.frames, progress))
    # All that are lost may have frames of other cameras: then those that are near are all there are.
    solved = _judged_together(problem, _near_solution(problem, near, progress), progress)
    if solved is not None:
        return problem, *solved, "near"
    return _search_around(problem, observer, lost, NO_CAMERAS if near is None else near.cameras, progress)


def _search_around(
    problem: Problem,
    observer: FrameObserver,
    lost: Sequence[int],
    near: Mapping[int, Camera],
    progress: ProgressReporter,
) -> Solved:
    """Search around their stored poses for the cameras that are `lost`, with those that were found `near` theirs."""
    solved = _judged_together(problem, search_in_overviews(problem, progress, near), progress)
    if solved is not None:
        return problem, *solved, "wide"

    # By all that the network sees.
    problem = observer.look_in_full(problem, lost, progress)
    solution = search_and_refine(problem, progress, near)
    solution = refit_zoomed(problem, solution, progress)
    while True:
        judged = judge_together(problem, solution.pitch, solution.results, progress)
        contradicted = [n for n in solution.together if not judged.cameras[n].accepted]
        if len(contradicted) in (0, len(solution.together)):
            return problem, solution, judged, "wide"
        # A camera that the others contradict must not have pulled at them.
        solution = refine_without(contradicted, problem, solution, progress)


def _near_solution(problem: Problem, near: NearSolution | None, progress: ProgressReporter) -> PoseSolution | None:
    """Return the solution of the near path; None unless all usable cameras are near."""
    if near is None or near.numbers != problem.usable:
        return None
    return with_unusable_cameras(problem, problem.cameras, near.refined, near.results, 0, progress)


def _judged_together(
    problem: Problem, solution: PoseSolution | None, progress: ProgressReporter
) -> tuple[PoseSolution, EngineResult] | None:
    """Judge the cameras of a solution against each other; None unless all that were refined together are accepted."""
    if solution is None:
        return None
    judged = judge_together(problem, solution.pitch, solution.results, progress)
    return (solution, judged) if all(judged.cameras[n].accepted for n in solution.together) else None


def _solve_in_paint(
    problem: Problem, solved: Solved, observer: FrameObserver, progress: ProgressReporter
) -> tuple[Solved, FrameObserver]:
    """Return the solution of a problem with the frames that it explains: `solved` in all colours, or that in one paint
    where the field's lines are told by it from others that are seen.

    Its cameras share a floor: lines of another sport are in view of all of them, where one that was turned is alone. In
    one paint less is seen of the field's lines. So the solution has to be the likelier one in all colours as well.
    """
    judged = solved[2]
    usable = problem.usable
    if not usable or any(judged.cameras[n].overlap.unexpected < MUCH_UNEXPECTED for n in usable):
        return solved, observer
    painted = show_paint_of_field(problem, observer, progress.muted())
    if painted is None:
        return solved, observer
    seen = painted.with_overviews(painted.seen_in(problem), progress)
    again = _search_around(seen, painted, range(len(problem.cameras)), NO_CAMERAS, progress)
    # What passes neither way is looked for elsewhere, by all that is seen.
    passes = any(one.accepted for one in [*judged.cameras, *again[2].cameras])
    is_better = passes and _log_odds(solved[0], again[2]) > _log_odds(solved[0], judged)
    return (again, painted) if is_better else (solved, observer)


def _log_odds(problem: Problem, judged: EngineResult) -> float:
    """Return how much likelier judged poses are than ones that chance finds, by the frames of a problem, in nats."""
    usable = problem.usable
    found = [judged.cameras[n].camera for n in usable]
    shares = [evidence_at(problem, n, camera).agreement for n, camera in zip(usable, found, strict=True)]
    return log_odds(problem.of(usable), found, shares)


def _recover(solved: Solved, observer: FrameObserver, progress: ProgressReporter) -> Solved:
    """Return the solution with those cameras in it that were knocked and found again; most nights there are none."""
    problem, _, judged, _ = solved
    is_clear = judged.accepted and not any(map(is_doubtful, judged.cameras))
    if is_clear and problem.options.search != "anywhere":
        return solved
    # Only such nights pay for loading it.
    from worker.calibration.recovery import recover_knocked

    problem, solution, judged, path = recover_knocked(solved, observer, _solve, progress)
    if problem.options.recover != "never":
        judged = _with_proposals(problem, solution, judged, progress)
    return problem, solution, judged, path


def _with_proposals(
    problem: Problem, solution: PoseSolution, judged: EngineResult, progress: ProgressReporter
) -> EngineResult:
    """Return the result that proposes the pose of each camera against which nothing speaks but how far it moved.

    No search has shown that such a pose is the only one, so it is never accepted, whatever the venue says.
    """
    from worker.calibration.recovery import as_knocked

    moved = [n for n, one in enumerate(judged.cameras) if one.refusal is not None and one.refusal.reason == "moved"]
    beyond = [n for n in moved if judged.cameras[n].moved.beyond(problem.gate)]
    if not beyond:
        return judged
    passed = [replace(one, refusal=None) if n in beyond else one for n, one in enumerate(judged.cameras)]
    together = judge_together(problem, solution.pitch, passed, progress)
    if any(one.accepted and not two.accepted for one, two in zip(judged.cameras, together.cameras, strict=True)):
        return judged
    knocked = {n: as_knocked(together.cameras[n]) for n in beyond if together.cameras[n].accepted}
    return judged.with_results([knocked.get(n, one) for n, one in enumerate(judged.cameras)])


def judge_together(
    problem: Problem, pitch: Field, results: Sequence[CameraResult], progress: ProgressReporter
) -> EngineResult:
    """Judge against each other cameras that were judged by themselves, on the `pitch` they were refined with."""
    gate = Gate()
    with progress.timed("quality"):
        progress.at("refinement", 0.6)
        pairs = _compared(problem, pitch, results)
    against = find_contradictions(pairs, gate) if any(result.accepted for result in results) else []
    ridge = ridge_rejection(pitch, gate)
    reasons = [f"camera {one.camera.id}: {one.rejected_because}" for one in results if one.rejected_because]
    reasons += [one.words(gate) for one in against]
    reasons += [ridge.words] if ridge else []
    judged = [
        replace(result, refusal=result.refusal or refusal_by_pairs(result.camera.id, against, gate) or ridge)
        for result in results
    ]
    accepted = {result.camera.id for result in judged if result.accepted}
    stitch = stitch_error_px([pair for pair in pairs if not accepted or accepted.issuperset(pair.cameras)], gate)
    by_id = {result.camera.id: result for result in judged}
    seams = [(pair, measure_seam(pitch, by_id[pair.first], by_id[pair.second])) for pair in pairs]
    return EngineResult(pitch, judged, in_one_sentence(reasons) or None, stitch, progress.timings, pairs=seams)


def _comparable(results: Sequence[CameraResult]) -> list[int]:
    """The cameras whose views are compared: those that pass the gate, or where none does, all that see anything."""
    accepted = [n for n, result in enumerate(results) if result.accepted]
    return accepted or [n for n, result in enumerate(results) if result.view.usable]


def _compared(problem: Problem, pitch: Field, results: Sequence[CameraResult]) -> list[Pair]:
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
    return measured_by_lines(pitch, pairs, seeing, problem.gate)


def _evidence_of(result: CameraResult) -> Evidence:
    return result.evidence


def _response_of(
    problem: Problem, number: int, camera: Camera, evidence: Callable[[], Evidence], result: CameraResult
) -> CameraResponse:
    """Return what is compared of camera `number` when it stands as `camera` does."""
    response = problem.observed.observations.responses[number] if number in problem.observed.in_full else None
    return CameraResponse(camera, response, evidence, result.measured)


def _compared_before(problem: Problem, judged: EngineResult) -> list[Pair]:
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


def diagnose(
    problem: Problem,
    solution: PoseSolution,
    judged: EngineResult,
    path: Path,
    loss: float,
    frames: Mapping[str, Sequence[Frame]],
    progress: ProgressReporter,
) -> Calibration:
    """Report on judged cameras: the stitch error before, what contradicts lens or field, what evens out their light."""
    with progress.timed("quality"):
        stitch_error_before_px = stitch_error_px(_compared_before(problem, judged), Gate())
        doubts = find_suspicions(credible_deviations(solution.deviations, judged.cameras, Gate()))
        progress.at("refinement", 1.0)
    with progress.timed("light"):
        accepted = [result.camera for result in judged.cameras if result.accepted]
        lights = evened_out(judged.pitch, accepted, {camera.id: frames[camera.id][0] for camera in accepted})
    progress.timings.ensure("evolution")
    return Calibration(
        pitch=judged.pitch,
        cameras=judged.cameras,
        rejected_because=judged.rejected_because,
        stitch_error_px=judged.stitch_error_px,
        timings=judged.timings,
        pairs=judged.pairs,
        stitch_error_before_px=stitch_error_before_px,
        loss=loss,
        generations=solution.generations,
        suspicions=doubts,
        path=path,
        lights=lights,
        memories={},
        responses={camera.id: problem.observed.seen_by_network(n) for n, camera in enumerate(problem.cameras)},
        in_full=[problem.cameras[n].id for n in sorted(problem.observed.in_full)],
    )


def remember(
    judged: EngineResult,
    stored: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    memories: Mapping[str, CameraMemory],
    taken_at: datetime | None,
) -> dict[str, CameraMemory]:
    """Return the memories of the cameras whose poses are accepted, with this job in them, which may be their first.

    That of a camera that was knocked begins anew, where it was found.
    """
    lines = judged.pitch.line_points()
    after = {}
    for before, result in zip(stored, judged.cameras, strict=True):
        if not result.accepted or result.measured is None:
            continue
        seen = fingerprint_of_frames(frames[before.id])
        job = AcceptedJob(
            result.camera, result.measured, lines, taken_at, result.repainted_markings, seen, zoomed=result.lens_changed
        )
        (memory,) = memories_of_field([None if result.knocked else memories.get(before.id)], lines)
        begun = result.camera if result.knocked else before
        after[before.id] = CameraMemory.from_first_job(begun, job) if memory is None else memory.after(job)
    return after
