"""The engine on one page: frames and stored poses in, new poses and verdicts out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from types import MappingProxyType

from worker.calibration.detection.view_condition import UsualView
from worker.calibration.gate.pairs import stitch_error_px
from worker.calibration.gate.quality import credible_deviations
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.joint_verdict import compare_stored, judge_together
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory, fingerprint_of_frames, memories_of_field
from worker.calibration.observe import NOTHING_USUAL, FrameObserver
from worker.calibration.problem import PoseSolution, Problem, Solution
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
from worker.calibration.solve import solve
from worker.calibration.steps import loss_of
from worker.calibration.stitching.photometric_alignment import evened_out

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

    # Solve and judge: where the cameras stood if all usable ones pass there, else by search and refinement; and among
    # the lines of several sports in the paint of one.
    solution, observer = solve(problem, observer, progress)

    # Recover: search anywhere for cameras that do not stand where they stood.
    solution = _recover(solution, observer, progress)
    problem, judged = solution.problem, solution.judged
    seen = [problem.observed.seen_by_network(n) for n in range(len(cameras))]
    recorder.observed(cameras, frames, problem.observed.views, seen)
    recorder.judged(judged.pitch, cameras, judged.cameras)

    # Diagnose, and remember.
    with progress.timed("quality"):
        loss = loss_of(problem, judged.pitch, [result.camera for result in judged.cameras])
    found = diagnose(problem, solution.poses, judged, solution.path, loss, frames, progress)
    return found if flattened else replace(found, memories=remember(judged, cameras, frames, memories, taken_at))


def _of_other_frames(memory: CameraMemory | None, frames: Sequence[Frame]) -> CameraMemory | None:
    """Return a memory, or None where these frames are all that it holds: sent again they say nothing new."""
    if memory is None or memory.jobs > 1:
        return memory
    return None if memory.frames == fingerprint_of_frames(frames) else memory


def _recover(solution: Solution, observer: FrameObserver, progress: ProgressReporter) -> Solution:
    """Return the solution with those cameras in it that were knocked and found again; most nights there are none."""
    judged, options = solution.judged, solution.problem.options
    if judged.accepted and options.search != "anywhere":
        return solution
    # Only such nights pay for loading it.
    from worker.calibration.recovery import recover_knocked

    solution = recover_knocked(solution, observer, progress)
    return solution if options.recover == "never" else _with_proposals(solution, progress)


def _with_proposals(solution: Solution, progress: ProgressReporter) -> Solution:
    """Return the solution that proposes the pose of each camera against which nothing speaks but how far it moved.

    No search has shown that such a pose is the only one, so it is never accepted, whatever the venue says.
    """
    from worker.calibration.recovery import as_knocked

    judged = solution.judged
    moved = [n for n, one in enumerate(judged.cameras) if one.refusal is not None and one.refusal.reason == "moved"]
    beyond = [n for n in moved if judged.cameras[n].moved.exceeds_limits]
    if not beyond:
        return solution
    passed = [replace(one, refusal=None) if n in beyond else one for n, one in enumerate(judged.cameras)]
    together = judge_together(solution.problem, solution.poses.pitch, passed, progress)
    if not together.accepts_all_of(judged):
        return solution
    knocked = {n: as_knocked(together.cameras[n]) for n in beyond if together.cameras[n].accepted}
    results = [knocked.get(n, one) for n, one in enumerate(judged.cameras)]
    return replace(solution, judged=judged.with_results(results))


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
        stitch_error_before_px = stitch_error_px(compare_stored(problem, judged))
        doubts = find_suspicions(credible_deviations(solution.deviations, judged.cameras))
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
    lines = judged.pitch.measured_points
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
