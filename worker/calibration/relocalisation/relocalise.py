"""Relocalisation with a verdict: a camera proposed by lines, refined onto measured lines, judged beside rivals.

A first pose has no stored one beside it. In place of "moved" and "the stored pose is better" it is asked whether a
clearly different pose explains the frame nearly as well.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from worker.calibration.detection.contrast import Channels
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.quality import ground_left_open
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.plausible_pose import films_a_field
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.relocalisation.candidate import Candidate, FrameObservations
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import HALF_TURN
from worker.calibration.relocalisation.paint import share
from worker.calibration.relocalisation.propose import ProposedCamera, propose
from worker.calibration.relocalisation.sought import SoughtCamera

TOO_LITTLE_PAINT = frozenset({"no-lines", "few-lines"})
BEGUN_ANEW = TOO_LITTLE_PAINT | {"lines"}
BEGUN_ANEW_WITH_OTHER_LENSES = BEGUN_ANEW | {"implausible", "not-unique"}
"""Reasons after which the search begins anew with other draws, through other lenses if there are any."""
REFINED = 4
"""Most proposals that are refined."""
DIFFERENT = 0.01
"""Mean distance between the markings in view of two different refined poses, as a part of the width of the frame."""
LEAST_OVERLAP = 0.2
"""Least intersection over union, as lengths of line, of the network's response and the expected lines. Edges of
other things lie along a line here and there, and a few lines of a pose are found by them alone. Right poses on
rendered and real views overlap by 0.27 and more; a wrong one that saw 0.93 of its two lines in the grain of a floor
did by 0.12."""
MORE_EXPLAINED = 0.05
"""Share of the paint by which one of two poses explains more than the other."""
LEAST_SURE = 0.0025
"""Largest standard deviation (rms) of the markings in view by the best pose, as a part of the width of the frame,
through a lens that is known; half of it through one that is found. Pose and lens that slide together, one to make up
for the other, keep every limit of a pose alone. Right ones on rendered views are sure to 0.0012 and better where the
lens is found, wrong ones to 0.0016 and worse."""

Reason = Literal["no-lines", "lines", "few-lines", "implausible", "not-unique", "not-confirmed"]


@dataclass(frozen=True)
class NotFound:
    """Reason why a camera that was found is not taken, in a word and in words with numbers and what to do."""

    reason: Reason
    words: str


@dataclass(frozen=True)
class Relocalisation:
    """Candidates for one camera, the best first; why that is refused, or None; and the assumptions made."""

    candidates: Sequence[Candidate]
    refusal: NotFound | None
    remarks: Sequence[str] = ()


def relocalise(
    field: Field,
    markings: FieldMap,
    sought: SoughtCamera,
    channels: Channels,
    response: Response,
    seed: int,
    pulse: Callable[[], None] = lambda: None,
    least_agreement: float = 0.0,
    in_another_way: Callable[[Relocalisation], Relocalisation | None] = lambda _: None,
) -> Relocalisation:
    """Find the camera that took a frame; `response` (height, width) in 0..1 of the network; `markings`: of the field.

    Where its focal length is not known, k1, k2 and principal point are found with it and the pose. `pulse` is called
    every second or so, and may raise to end the search. Proposals of less than `least_agreement` are not refined.
    `in_another_way` is asked for a better result than a refused one, before the search begins anew.
    """
    observed = FrameObservations.of(field, channels, response)
    candidates = list[Candidate]()
    looked, through = observed, sought
    farther = 2 if sought.is_lens_sought else REFINED
    for attempt in range(3):
        pulse()
        best_before = next(iter(candidates), None)
        proposals = [
            one for one in propose(markings, looked.small, through, seed + attempt) if one.agreement >= least_agreement
        ]
        refined = list[tuple[Camera, Candidate]]()
        for camera in _distinct(field, markings, sought, proposals):
            tried = [*candidates, *(candidate for _, candidate in refined)]
            if any(not _differ(field, markings, one.camera, camera, DIFFERENT) for one in tried):
                continue
            pulse()
            caught = camera if looked is observed else looked.candidate(camera, sought).camera
            refined.append((caught, observed.candidate(caught, sought)))
        refined.sort(key=lambda one: -one[1].agreement)
        candidates += [observed.on_lines_farther_off(camera, close, sought) for camera, close in refined[:farther]]
        candidates += [close for _, close in refined[farther:]]
        candidates.sort(key=lambda one: -one.agreement)
        found = Relocalisation(
            _to_choose_from(field, markings, candidates), why_not_taken(field, markings, sought, candidates)
        )
        if attempt == 0 and found.refusal is not None and (other := in_another_way(found)) is not None:
            return other
        reasons = BEGUN_ANEW_WITH_OTHER_LENSES if sought.other_lenses else BEGUN_ANEW
        if found.refusal is None or found.refusal.reason not in reasons:
            break
        if attempt > 0 and next(iter(candidates), None) is best_before:
            # Two searches with draws of their own that end at the same best pose have missed none.
            break
        if sought.other_lenses:
            through = replace(sought, lenses=sought.other_lenses)
        if found.refusal.reason in TOO_LITTLE_PAINT or attempt > 0:
            # Then faint paint is paint as well, and so is more that is none.
            looked = observed.strengthened(1.6)
    if found.refusal is not None or not sought.is_lens_sought:
        return found
    # The lens that was found is stored and stays; a pose is refined again by every calibration.
    best, *others = found.candidates
    return replace(found, candidates=[observed.settled(best.camera, sought), *others])


def _to_choose_from(field: Field, markings: FieldMap, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the best candidates, and each other one that may be the true one as well."""
    best, others = candidates[:REFINED], candidates[REFINED:]
    return [*best, *(rivals(field, markings, best[0], others) if others else ())]


def _distinct(
    field: Field, markings: FieldMap, sought: SoughtCamera, proposals: Sequence[ProposedCamera]
) -> list[Camera]:
    """Return the cameras to be refined: good beside the best, and different from each other."""
    chosen = list[Camera]()
    for one in proposals:
        if len(chosen) == REFINED or one.agreement < proposals[0].agreement - 0.12:
            break
        camera = Camera(sought.id, one.lens, one.pose, ignored=sought.ignored)
        if all(_differ(field, markings, other, camera, 0.04) for other in chosen):
            chosen.append(camera)
    return chosen


def why_not_taken(
    field: Field, markings: FieldMap, sought: SoughtCamera, candidates: Sequence[Candidate]
) -> NotFound | None:
    """Return why the best candidate is not taken, None if it is; a calibration will judge its exactness."""
    if not candidates:
        return NotFound("no-lines", "no lines of a field are seen in the frame; is the view free and lit?")
    best, *others = candidates
    seen = best.evidence
    # Least share of the expected lines found, beyond chance. Right poses on real frames find 0.86 and more, wrong ones
    # up to 0.9.
    if seen.agreement < 0.7 and not _is_likely_in_place(sought, best):
        return NotFound(
            "lines",
            f"no pose explains the lines: at the best one {seen.share:.0%} of the markings in view are seen "
            f"({seen.by_chance:.0%} would be anywhere); are sport and measures of the field right, is the view free?",
        )
    if best.overlap.iou < LEAST_OVERLAP:
        return NotFound(
            "lines",
            f"the network does not see the lines of the best pose: they overlap by {best.overlap.iou:.0%} with what it "
            f"sees, at least {LEAST_OVERLAP:.0%} are needed; are sport and measures of the field right, is the view "
            "free?",
        )
    if best.residual_px is None or best.ground_sigma is None:
        return NotFound("few-lines", "too few points of lines could be measured; is the view free and lit?")
    if (left_open := _left_open(best, sought)) is not None:
        lines, advice = "leave the pose open", "let the camera see more of the field"
        if sought.is_lens_sought:
            lines = "do not tell lens and pose apart"
            advice = f"say what the lens or its field of view is, or {advice}"
        return NotFound("few-lines", f"the lines in view {lines}: {left_open}; {advice}")
    if sought.is_lens_sought and not sees_all_of_its_frame(best.camera.intrinsics):
        return NotFound(
            "implausible",
            "the lens that fits the lines best bends the picture back before its corners, so that it is wrong towards "
            "them; say what the lens or its field of view is, or let the camera see more of the field",
        )
    if not films_a_field(best.camera.pose):
        return NotFound("implausible", "the best pose is none from which a field is filmed: upside down, or far away")
    rival = next(rivals(field, markings, best, others), None)
    if rival is not None:
        return NotFound(
            "not-unique",
            f"two poses explain the lines: {seen.share:.0%} and {rival.evidence.share:.0%} of the markings in view "
            "are seen where they put them; say where the camera stands, or let it see more of the field",
        )
    return None


def _left_open(best: Candidate, sought: SoughtCamera) -> str | None:
    """Return in words how far off the markings in view may be in the picture or on the ground; None if little."""
    assert best.ground_sigma is not None
    least_sure = LEAST_SURE / 2 if sought.is_lens_sought else LEAST_SURE
    sure_px, most_px = best.ground_sigma.rms_px, least_sure * best.camera.intrinsics.size[0]
    if sure_px > most_px:
        return f"they may lie {sure_px:.1f} pixels from where the best pose puts them (at most {most_px:.1f} allowed)"
    return ground_left_open(best.ground_sigma)


def rivals(field: Field, markings: FieldMap, best: Candidate, others: Iterable[Candidate]) -> Iterator[Candidate]:
    """Yield candidates that may be the true one as well as the best; all of them clearly differ from each other."""
    different = [best]
    for other in others:
        if explains_nearly_as_well(other, best) and all(
            _differ(field, markings, one.camera, other.camera, DIFFERENT) for one in different
        ):
            different.append(other)
            yield other


def _is_likely_in_place(sought: SoughtCamera, best: Candidate) -> bool:
    """True if a camera is found turned on its mount, which needs fewer of its lines than one anywhere."""
    if sought.place.position is None or sought.is_lens_sought:
        return False
    # There are few other poses from which it could be.
    return best.evidence.agreement >= 0.6 and best.explained >= 0.85


def sees_all_of_its_frame(lens: Lens) -> bool:
    """True if each pixel of the frame has a ray: if the model grows as far as to the corners."""
    return bool(np.isfinite(lens.directions(lens.border(20))).all())


def explains_nearly_as_well(other: Candidate, best: Candidate) -> bool:
    """True if another candidate may be the true one.

    It agrees little less both ways; and it misses hardly more of its lines, or explains more of the paint, or explains
    paint that the best does not and overlaps with the lines nearly as the best does. It may not if it explains nothing
    of its own and the best outdoes it, nor if it explains no more and lines lie clearly farther from it.
    """
    if other.agreement < best.agreement - 0.15:
        return False
    missed, other_missed = (1 - one.evidence.agreement for one in (best, other))
    has_paint_of_its_own = share(other.explains & ~best.explains) > 0.02
    if not has_paint_of_its_own and _is_outdone(other, best):
        return False
    if other.explained <= best.explained and _is_less_exact(other, best):
        return False
    return (
        other_missed < 2.5 * missed + 0.05
        or other.explained > best.explained + MORE_EXPLAINED
        or (has_paint_of_its_own and other.overlap.iou > 0.8 * best.overlap.iou)
    )


def _is_less_exact(other: Candidate, best: Candidate) -> bool:
    """True if both were measured and lines lie clearly farther from the other one."""
    if other.residual_px is None or best.residual_px is None:
        return False
    return other.residual_px > 1.4 * best.residual_px


def _is_outdone(other: Candidate, best: Candidate) -> bool:
    """True if the best of two that explain the same paint explains more of it, or sees more of its lines.

    It explains a little more if the other misses as many lines, much more if the other misses fewer, and as much if the
    other misses clearly more: yard lines farther on, one of them where there is none.
    """
    misses_more = best.evidence.agreement - other.evidence.agreement
    explains_less = best.explained - other.explained
    if misses_more > 0.04:
        return explains_less > -0.01
    return explains_less > (MORE_EXPLAINED if misses_more >= 0 else 0.2)


def twin(camera: Camera) -> Camera:
    """Return the camera that sees the same of a field which half a turn about its centre leaves as it is."""
    pose = camera.pose
    turned = Pose(rotation_vectors(pose.matrix @ HALF_TURN), HALF_TURN @ pose.position)
    return replace(camera, pose=turned)


def _differ(field: Field, markings: FieldMap, one: Camera, other: Camera, apart: float) -> bool:
    """True if two cameras put the markings that the first one sees apart by such a part of the frame's width."""
    width = one.intrinsics.size[0]
    return not mean_shift_px(field, markings, one, other, width) < apart * width


def mean_shift_px(
    field: Field,
    markings: FieldMap,
    one: Camera,
    other: Camera,
    unseen_px: float,
    *,
    as_other_has_it: Field | None = None,
) -> float:
    """Return the mean distance (px) of the markings in view of one camera by it and another; NaN without any.

    On a symmetric field it is the nearer of the other camera and its twin. Markings that that does not see count as
    `unseen_px` off. `as_other_has_it`: the field on the ground that was found with the other camera.
    """
    lines = field.line_points().position
    by_other = lines if as_other_has_it is None else as_other_has_it.lift(lines[:, :2])
    seen = one.project(lines)
    in_view = inside(seen, one.intrinsics.size)
    if not in_view.any():
        return float("nan")
    return min(
        float(
            np.nan_to_num(
                np.linalg.norm(camera.project(by_other[in_view]) - seen[in_view], axis=1), nan=unseen_px
            ).mean()
        )
        for camera in ([other, twin(other)] if markings.is_symmetric else [other])
    )
