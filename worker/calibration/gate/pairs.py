"""Pairs of cameras: whether two of them put the same markings in the same place, and which one is wrong."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.diagnostics.line_registration import MeasuredLines, register_lines
from worker.calibration.diagnostics.registration import (
    PIXEL_M,
    Registration,
    Response,
    pair_error_px,
    pairs_in_common,
    register_pair,
    shares_plenty,
)
from worker.calibration.gate.quality import GATE, CameraResult, Reason, Refusal
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field


@dataclass(frozen=True)
class CameraResponse:
    """Camera with the segmentation (H, W) of its frame in 0..1.

    `evidence`: computes the evidence for the lines, and is asked only where two cameras cannot be registered.
    `response` None: the network has not looked at the frame in full, and the lines `measured` in it register it with
    others.
    """

    camera: Camera
    response: Response | None
    evidence: Callable[[], Evidence]
    measured: Measurements | None = None


@dataclass(frozen=True)
class Pair:
    """Two cameras, by their ids, that should show some of the same markings.

    `error_px`: distance between the places where they put them, 1 px = 10 cm; None where their views cannot be
    registered, and then there is no `registration`. `plenty`: they share so much that this tells something;
    `confirmed`: they register, or both see what they share where their poses put it. `shift_px`: that distance in
    pixels of the frame that shows it larger.
    """

    first: str
    second: str
    error_px: float | None
    plenty: bool
    confirmed: bool
    registration: Registration | None = None
    shift_px: float = np.inf

    @property
    def cameras(self) -> tuple[str, str]:
        """Ids of both cameras."""
        return self.first, self.second

    def agrees(self) -> bool:
        """Return whether the two cameras confirm each other.

        Where far grass moves by less than a pixel of either frame, neither tells its place any better.
        """
        is_near = self.error_px is not None and self.error_px <= GATE.largest_stitch_error_px
        return is_near or self.shift_px <= GATE.largest_ground_sigma_px

    @property
    def missed(self) -> bool:
        """True if the views should register and do not."""
        return self.error_px is None and self.plenty and not self.confirmed

    def disagrees(self) -> bool:
        """True if the cameras contradict each other. Two that share too little to be compared do neither."""
        return self.missed or (self.error_px is not None and not self.agrees())

    def words(self) -> str:
        """Return the contradiction in words, and what to do."""
        both = f"{self.first} and {self.second}"
        if self.error_px is None:
            return (
                f"the views of {both} should show the same markings but cannot be brought together; look at the preview"
            )
        return (
            f"the cameras {both} do not fit each other: stitch error {self.error_px:.2f} px, at most "
            f"{GATE.largest_stitch_error_px} allowed, which is {self.shift_px:.1f} px of a frame, at most "
            f"{GATE.largest_ground_sigma_px} allowed; look at the preview, and check intrinsics and ridge"
        )


@dataclass(frozen=True)
class Contradiction:
    """Pair of which at least one camera is wrong. `blamed`: which, or both where nothing tells."""

    pair: Pair
    blamed: Sequence[str]

    def words(self) -> str:
        """Return the contradiction in words, naming the camera to blame where it is one of them."""
        whose = f"camera {self.blamed[0]}: " if len(self.blamed) == 1 else ""
        return whose + self.pair.words()


def compare_pairs(pitch: Field, cameras: Sequence[CameraResponse]) -> list[Pair]:
    """Compare the pairs of cameras that should show some of the same markings."""
    by_id = {one.camera.id: one for one in cameras}
    found = []
    for pair in pairs_in_common(pitch, [one.camera for one in cameras]):
        first, second = (by_id[camera.id] for camera in pair)
        registered = _register(pitch, first, second)
        error_px = None if registered is None else registered.error_px
        confirmed = registered is not None or _both_see(first.evidence(), second.evidence())
        plenty, shift_px = shares_plenty(pitch, *pair), _shift_px(pitch, registered, pair)
        found.append(Pair(pair[0].id, pair[1].id, error_px, plenty, confirmed, registered, shift_px))
    return found


def _shift_px(pitch: Field, registered: Registration | None, cameras: Sequence[Camera]) -> float:
    """Return the distance of a pair's places of one point, px of the frame that shows it larger; inf if unknown."""
    if registered is None:
        return np.inf
    apart = PIXEL_M * np.array([registered.dx_px, registered.dy_px])
    places = pitch.lift(np.array([registered.at, registered.at + apart]))
    return float(max(np.linalg.norm(np.diff(camera.project(places), axis=0)) for camera in cameras))


def _register(pitch: Field, first: CameraResponse, second: CameraResponse) -> Registration | None:
    """Register two cameras by their responses, or by their measured lines unless both have one."""
    if first.response is not None and second.response is not None:
        return register_pair(pitch, first.camera, second.camera, first.response, second.response)
    return _register_lines(pitch, first, second)


def _register_lines(pitch: Field, first: CameraResponse, second: CameraResponse) -> Registration | None:
    if first.measured is None or second.measured is None:
        return None
    return register_lines(
        pitch, MeasuredLines(first.camera, first.measured), MeasuredLines(second.camera, second.measured)
    )


def measured_by_lines(pitch: Field, pairs: Sequence[Pair], cameras: Sequence[CameraResponse]) -> list[Pair]:
    """Return the pairs, those that agree with the error by the lines measured in both views.

    So the error means the same whether or not the network has looked in full, and lines are measured finer than
    responses. Contradictions come from the responses: a camera that takes one line for another measures none.
    """
    by_id = {one.camera.id: one for one in cameras}
    found = []
    for pair in pairs:
        both = [by_id[camera] for camera in pair.cameras]
        lines = _register_lines(pitch, *both) if pair.agrees() else None
        if lines is not None:
            shift_px = _shift_px(pitch, lines, [one.camera for one in both])
            finer = replace(pair, error_px=lines.error_px, registration=lines, shift_px=shift_px)
            pair = finer if finer.agrees() else pair
        found.append(pair)
    return found


def compare_pairs_before(
    pitch: Field, stored: Mapping[str, CameraResponse], found: Mapping[str, Camera], pairs: Sequence[Pair]
) -> list[Pair]:
    """Compare the same pairs by their `stored` poses, at the places of the `found` ones where these register."""
    before = []
    for pair in pairs:
        seeing = [stored[camera] for camera in pair.cameras]
        if pair.registration is None:
            before += compare_pairs(pitch, seeing)
        else:
            now = (found[pair.first], found[pair.second])
            error_px = pair_error_px(pitch, pair.registration, now, (seeing[0].camera, seeing[1].camera))
            before.append(Pair(pair.first, pair.second, error_px, pair.plenty, confirmed=True))
    return before


def _both_see(first: Evidence, second: Evidence) -> bool:
    """True if both find most of the line that both should see, each where its pose puts it."""
    _, a, b = np.intersect1d(first.index, second.index, return_indices=True)
    return len(a) > 0 and float(np.mean(first.found[a] & second.found[b])) >= 0.6


def find_contradictions(pairs: Sequence[Pair]) -> list[Contradiction]:
    """Return the pairs that disagree and the cameras to blame: those that agree with nobody, or else both.

    Two that both agree with others contradict each other only where they share plenty and can be compared.
    """
    confirmed = {camera for pair in pairs if pair.agrees() for camera in pair.cameras}
    found = []
    for pair in pairs:
        loose = [camera for camera in pair.cameras if camera not in confirmed]
        if pair.disagrees() and (loose or (pair.plenty and pair.error_px is not None)):
            found.append(Contradiction(pair, loose or pair.cameras))
    return found


def refusal_by_pairs(camera: str, against: Sequence[Contradiction]) -> Refusal | None:
    """Return the refusal of a camera that pairs contradict, None where none does."""
    contradicting = [one.pair for one in against if camera in one.blamed]
    if not contradicting:
        return None
    reason: Reason = "not-together" if contradicting[0].error_px is None else "disagree"
    return Refusal(reason, "; ".join(pair.words() for pair in contradicting))


def stitch_error_of(pairs: Sequence[Pair], results: Sequence[CameraResult]) -> float | None:
    """Return the stitch error (px) of the pairs of accepted cameras; of all pairs if no camera is accepted."""
    accepted = {result.camera.id for result in results if result.accepted}
    return stitch_error_px([pair for pair in pairs if not accepted or accepted.issuperset(pair.cameras)])


def stitch_error_px(pairs: Sequence[Pair]) -> float | None:
    """Return the worst disagreement of pairs that confirm or contradict each other.

    None if none does, or if one cannot be registered that should be.
    """
    telling = [pair for pair in pairs if pair.agrees()] + [one.pair for one in find_contradictions(pairs)]
    if any(pair.missed for pair in telling):
        return None
    return max((pair.error_px for pair in telling if pair.error_px is not None), default=None)
