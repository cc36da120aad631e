"""Recovery of knocked cameras, whose lines are seen elsewhere than expected.

Such a camera is searched for where it stood, turned on its mount by any angle; and if that finds nothing and the
calibration was asked to, anywhere. What is found is refined and judged with the other cameras, as if it had been
stored, and holds only if none of them is refused for it. Beyond the gate's limits of movement it is proposed to a
person, or accepted where the venue says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from worker.calibration.detection.view_condition import (
    LEAST_LIGHT,
    OF_THE_GROUND,
    ViewCondition,
    least_light,
    look_at,
)
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.pairs import stitch_error_of
from worker.calibration.gate.quality import CameraResult, Moved, Refusal
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.observe import FrameObserver
from worker.calibration.problem import Problem, Solution
from worker.calibration.records import ProgressReporter
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.paint import Paint
from worker.calibration.relocalisation.relocalise import Relocalisation, mean_shift_px, relocalise, twin
from worker.calibration.relocalisation.sought import ANYWHERE, KNOCKED_ROLL_DEG, Place, SoughtCamera, SoughtLens
from worker.calibration.solve import solve_in_all_colours

LOST = frozenset({"lines", "few-lines"})
"""Reasons for a refusal of a camera that may have been knocked..."""
LOST_IF_FAR = frozenset({"moved", "undetermined", "stored-better"})
"""...and those of one that may have been if it moved farther than the gate allows. These are given although lines are
seen where the pose has them: a camera whose field was repainted is undetermined where it stands, and would be accepted
where a search puts it."""
UNFIT = frozenset({"residual", "zoomed", "undetermined"})
"""Reasons for a refusal that a camera may have where it was found, and would have had if it had not been knocked."""
LEAST_PAINT, LEAST_UNEXPLAINED, UNEXPLAINED_BY_WEATHER = 200, 0.25, 0.85
"""Lines are clearly seen elsewhere when so many of the places on the middles of paint are there, and this share of them
lies on no line by any pose that was found: one that was caught by wrong lines explains up to 0.7 of the paint. Where
the frame looks fogged or blocked at that pose it has to be nearly all of them: what shows through fog, or beside what
blocks the view, lies for a third or more on the lines of a camera that has not moved, and a search every quarter of an
hour of a foggy night is dear."""
LOOKED_AT_EVERY = 4
OF_THE_LIGHT = frozenset({"dark", "blinded"})
BRIGHTEST, LEAST_LIT = 245, 0.3
"""A field that is too dark or too bright where the stored pose has it may lie elsewhere, and lit, if this share of the
frame is no brighter, of 255, and not too dark either."""
LEAST_LIGHT_IN_THE_DARK = 5.0
"""Brightness (0..255) above which a dark field would show its lines, if it is clearly brighter than its noise: where
none are seen, the camera may have been knocked and the field lie elsewhere in its frame."""
ON_ITS_MOUNT_M = 2.5
"""Radius around its stored place in which a camera is searched for first."""
LEAST_PROPOSED = 0.34
"""Poses that agree less with the lines before they are refined are not refined, unless a search was asked for. Those of
real frames that were found agree by 0.44 and more, those of upside-down frames and other sports by 0.17 to 0.36."""
CLEARLY_NEARER, MUCH_LESS_TURNED_DEG = 0.5, 60.0
"""Of a camera and its twin on a symmetric field the one is taken that is clearly nearer to the stored place: by less
than this part of the other's distance; or else the one that is turned by so much less."""
OWN_PLACE_M = 0.1
"""A camera that looks where another one of the venue looks stands in its own place if that is so much nearer."""
HOPELESS = frozenset({"no-lines", "not-unique"})
"""What a search where a camera stood ends with, and one anywhere would all the more."""
UNSEEN_PX, SAME_PART = 1e4, 0.002
"""What a marking counts that only one of two cameras sees; and cameras are the same that put the markings apart by less
than this part of the frame's width."""


@dataclass(frozen=True)
class FoundAgain:
    """A camera at the pose where it was found, what is seen in all of its frame, and the view condition there."""

    camera: Camera
    response: Response
    view: ViewCondition


def recover_knocked(solution: Solution, observer: FrameObserver, progress: ProgressReporter) -> Solution:
    """Return the solution with those cameras in it that were searched for and found again.

    The cameras of its problem are at their stored poses.
    """
    problem, judged = solution.problem, solution.judged
    if problem.options.search == "wide" or problem.options.recover == "never":
        return solution
    doubted = [n for n in range(len(problem.cameras)) if _refusal_may_concern_wrong_region(problem, n, observer)]
    problem = observer.look_in_full(problem, doubted, progress)
    sought = _sought(problem, judged.cameras, doubted)
    if not sought:
        return solution
    solution = replace(solution, problem=problem)
    with progress.timed("evolution"):
        searched = {n: _search(problem, judged.cameras[n], n, observer, progress) for n in sought}
    found = {n: one for n, one in searched.items() if one is not None}
    while found:
        there = _restart_from(problem, found)
        again = solve_in_all_colours(there, replace(observer, cameras=there.cameras), progress.muted())
        confirmed = {n: one for n, one in found.items() if _is_there(again.judged.cameras[n])}
        harmed = not again.judged.accepts_all_of(judged)
        if confirmed.keys() == found.keys() and not harmed:
            return _merge(solution, again, found)
        found = {} if harmed and confirmed.keys() == found.keys() else confirmed
    return solution


def _refusal_may_concern_wrong_region(problem: Problem, number: int, observer: FrameObserver) -> bool:
    """True if the refusal of a view may concern the wrong region: what the stored pose takes for the field."""
    view = problem.observed.views[number]
    figures = view.figures
    if view.cause == "dark" and figures.brightness > least_light(figures.noise, LEAST_LIGHT_IN_THE_DARK):
        return True
    if view.cause in OF_THE_LIGHT:
        frame = observer.frames[problem.cameras[number].id][0]
        brightness = cv2.cvtColor(frame[::LOOKED_AT_EVERY, ::LOOKED_AT_EVERY], cv2.COLOR_BGR2GRAY)
        return bool(((brightness >= LEAST_LIGHT) & (brightness <= BRIGHTEST)).mean() >= LEAST_LIT)
    return view.cause in OF_THE_GROUND


def _sought(problem: Problem, results: Sequence[CameraResult], doubted: Sequence[int]) -> list[int]:
    """Return the indices of the cameras to search for: all that were asked for, or those that may have been knocked.

    `doubted`: those whose view may be refused for the wrong region.
    """
    if problem.options.search == "anywhere":
        return [n for n, one in enumerate(results) if one.view.cause != "other-camera"]
    responses = problem.observed.observations.responses
    # Lines that the network saw elsewhere contradict what is said of a view.
    contradicted = {n for n in doubted if _has_lines_elsewhere(problem, results[n], responses[n])}
    return [n for n, one in enumerate(results) if n in contradicted or _is_lost(one)]


def _is_lost(result: CameraResult) -> bool:
    """True if a camera may have been knocked."""
    if result.refusal is None:
        return False
    if result.refusal.reason in LOST_IF_FAR:
        # A mount that gave way over many nights stands where it was found last night.
        return result.moved.exceeds_limits
    return result.refusal.reason in LOST


def _is_there(result: CameraResult) -> bool:
    """True if a camera stands where it was found: the gate accepts it, or refuses only its lens or its sigma."""
    return result.refusal is None or result.refusal.reason in UNFIT


def _search(
    problem: Problem,
    result: CameraResult,
    number: int,
    observer: FrameObserver,
    progress: ProgressReporter,
) -> FoundAgain | None:
    """Search for a camera at its stored place, and then, if that was asked for, anywhere; None if not surely found."""
    stored = problem.cameras[number]
    progress.at("evolution", 0.0)
    response = observer.response_everywhere(stored)
    if problem.options.search == "auto" and not _has_lines_elsewhere(problem, result, response):
        return None
    markings = FieldMap.of(problem.pitch)
    sought = SoughtCamera(
        stored.id, [SoughtLens.known(stored.intrinsics)], ignored=stored.ignored, roll_sigma_deg=KNOCKED_ROLL_DEG
    )
    mount = Place(position=stored.pose.position, radius_m=ON_ITS_MOUNT_M)
    for place in (mount, ANYWHERE) if problem.options.search == "anywhere" else (mount,):
        found = relocalise(
            problem.pitch,
            markings,
            replace(sought, place=place),
            problem.observed.observations.channels[number],
            response,
            problem.options.seed,
            lambda: progress.at("evolution", 0.5),
            least_agreement=0.0 if problem.options.search == "anywhere" else LEAST_PROPOSED,
        )
        camera = _on_its_side(markings, stored, found, place)
        if camera is not None and not _is_anothers(problem, number, camera):
            camera = stored.with_pose(camera.pose)
            if result.accepted and not _is_better(problem, markings, result, found.candidates[0], camera):
                return None
            view = look_at(observer.frames[stored.id][0], problem.pitch, camera)
            return FoundAgain(camera, response, view) if view.usable else None
        if found.refusal is not None and found.refusal.reason in HOPELESS:
            break
    return None


def _has_lines_elsewhere(problem: Problem, result: CameraResult, response: Response) -> bool:
    """True if lines are clearly seen that the found pose does not explain; any lines, if the camera moved too far."""
    paint = Paint.of(np.rint(response * 255).astype(np.uint8))
    if len(paint.middles) < LEAST_PAINT:
        return False
    if result.refusal is not None and result.moved.exceeds_limits:
        return True
    least = LEAST_UNEXPLAINED if result.view.usable else UNEXPLAINED_BY_WEATHER
    return paint.explained_by(problem.pitch, result.camera) <= 1 - least


def _on_its_side(markings: FieldMap, stored: Camera, found: Relocalisation, place: Place) -> Camera | None:
    """Return the found camera or its twin on a symmetric field, whichever stands where it stood; None if unclear."""
    if found.refusal is not None:
        return None
    camera = found.candidates[0].camera
    if not place.is_anywhere:
        return camera if place.allows(camera.pose.position[None])[0] else None
    if not markings.is_symmetric:
        return camera
    near, far = sorted((camera, twin(camera)), key=lambda one: stored.distance_m(one))
    if stored.distance_m(near) < CLEARLY_NEARER * stored.distance_m(far):
        return near
    less, more = sorted((camera, twin(camera)), key=lambda one: _turned_deg(stored, one))
    return less if _turned_deg(stored, less) < _turned_deg(stored, more) - MUCH_LESS_TURNED_DEG else None


def _is_anothers(problem: Problem, number: int, found: Camera) -> bool:
    """True if the frame is rather another camera's: cables are exchanged more often than cameras."""
    return any(
        n != number
        and other.intrinsics.size == found.intrinsics.size
        and not Moved.between(problem.pitch, other, found).exceeds_limits
        and other.distance_m(found) < problem.cameras[number].distance_m(found) + OWN_PLACE_M
        for n, other in enumerate(problem.cameras)
    )


def _restart_from(problem: Problem, found: Mapping[int, FoundAgain]) -> Problem:
    """Return the problem as if cameras had been stored where they were found; knocked ones without their memories."""
    cameras, memories, views = list(problem.cameras), list(problem.memories), list(problem.observed.views)
    responses = list(problem.observed.observations.responses)
    for n, one in found.items():
        if Moved.between(problem.pitch, problem.cameras[n], one.camera).exceeds_limits:
            memories[n] = None
        cameras[n], views[n], responses[n] = one.camera, one.view, one.response
    observations = replace(problem.observed.observations, responses=responses)
    in_full = frozenset([*problem.observed.in_full, *found])
    observed = replace(problem.observed, views=views, observations=observations, in_full=in_full)
    # Whatever was asked for, from there they are near.
    options = replace(problem.options, search="auto", found=frozenset(cameras[n].id for n in found))
    return replace(problem, cameras=cameras, memories=memories, observed=observed, options=options)


def _merge(before: Solution, again: Solution, found: Mapping[int, FoundAgain]) -> Solution:
    """Merge the found cameras into the solution before, beside their stored poses; a proposed one moves no other."""
    problem = before.problem
    results = zip(again.judged.cameras, before.judged.cameras, strict=True)
    back = {n: _beside_stored(problem, n, *both) for n, both in enumerate(results) if n in found}
    base = before if all(result.refusal is not None for result in back.values()) else again
    merged = [back.get(n, result) for n, result in enumerate(base.judged.cameras)]
    stitch = stitch_error_of([pair for pair, _ in again.judged.pairs], merged)
    judged = replace(base.judged.with_results(merged), stitch_error_px=stitch, pairs=again.judged.pairs)
    return Solution(replace(again.problem, cameras=problem.cameras), base.poses, judged, "anywhere")


def _beside_stored(problem: Problem, number: int, result: CameraResult, before: CameraResult) -> CameraResult:
    """Return the result of a found camera beside its stored pose; refused where a person has to be asked."""
    moved = Moved.between(problem.pitch, problem.cameras[number], result.camera)
    result = replace(result, moved=moved, evidence_before=before.evidence_before)
    if not moved.exceeds_limits:
        return result
    if result.refusal is not None:
        words = f"{_turned_and_moved(moved)}, and found again there, but {result.refusal.words}"
        return replace(result, knocked=True, refusal=replace(result.refusal, words=words))
    return replace(result, knocked=True) if problem.options.recover == "accept" else as_knocked(result)


def as_knocked(result: CameraResult) -> CameraResult:
    """Return the result of a camera that was found beyond the gate's limits of movement, proposed to a person."""
    return replace(result, knocked=True, refusal=Refusal("knocked", _proposal(result)))


def _turned_and_moved(moved: Moved) -> str:
    return f"turned by {moved.rotation_deg:.1f} degrees and moved by {moved.position_m:.2f} m"


def _proposal(result: CameraResult) -> str:
    return (
        f"{_turned_and_moved(result.moved)}, and found again: {result.evidence.share:.0%} of the lines are seen where "
        "the new pose puts them; look at its picture, then accept the job by hand, or turn the camera back"
    )


def _is_better(problem: Problem, markings: FieldMap, result: CameraResult, found: Candidate, camera: Camera) -> bool:
    """True if a camera was found at another pose than it was accepted at, with more of its lines there."""
    if found.evidence.agreement <= result.evidence.agreement:
        return False
    return not _is_same(problem, markings, result.camera, camera)


def _is_same(problem: Problem, markings: FieldMap, one: Camera, other: Camera) -> bool:
    """True if two cameras put the markings that the first one sees in the same places."""
    shift_px = mean_shift_px(problem.pitch, markings, one, other, UNSEEN_PX)
    return shift_px < SAME_PART * one.intrinsics.size[0]


def _turned_deg(stored: Camera, camera: Camera) -> float:
    return float(rotation_angles_deg(stored.pose.rotation, camera.pose.rotation))
