"""The engine's third page: cameras as a file of any origin has them, and frames, in; how good each is, and why, out.

First the file is taken at its word: the cameras are calibrated from where it puts them, as a job does. Those that are
found elsewhere may stand there on another field: one that is crowned, or of other measures, if the lines say so. For
those that are not found, in this order, the first that the gate accepts: the poses in another convention and the lens
at another resolution, the camera turned where it stands, zoomed where it stands, anywhere, or with another lens.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from worker.calibration.calibrate import calibrate
from worker.calibration.checking.changes import shift_px
from worker.calibration.checking.ranking import films_the_field, rank_readings
from worker.calibration.checking.readings import Reading
from worker.calibration.detection.evidence import TOLERANCE_PX
from worker.calibration.detection.segmentation import whole_frame
from worker.calibration.field_fit.measures import fit_field
from worker.calibration.find_cameras import find_cameras
from worker.calibration.gate.quality import CameraResult, alone_rejection
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.plausible_pose import films_a_field
from worker.calibration.records import CalibrationError, Options, Progress, ProgressReporter, Recover, Segment
from worker.calibration.recovery import LEAST_PAINT, ON_ITS_MOUNT_M, UNEXPLAINED_BY_WEATHER
from worker.calibration.relocalisation.field_paint import FloorPaints
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.paint import Paint
from worker.calibration.relocalisation.sought import (
    ANYWHERE,
    KNOCKED_ROLL_DEG,
    Place,
    SoughtCamera,
    SoughtLens,
    unknown_lenses,
)
from worker.calibration.robust import SURE

Search = Literal["zoomed", "anywhere", "lens"]
TAKEN_AT_ITS_WORD = Reading((), 1.0, np.eye(3), np.eye(3), (0, 0))
CALIBRATED = 3
"""Readings that are calibrated from, of those that are likelier than the file at its word."""
READINGS_AT, SEARCH_AT = 0.1, 0.4
"""Shares of the whole at which readings and searches begin, if they do: by the core-seconds of a zoomed pair."""
ZOOM_UNCERTAIN = 0.25
"""Relative sigma of a focal length that somebody may have zoomed."""
INEXACT = frozenset({"residual", "zoomed", "undetermined"})
"""Reasons of the gate against poses that explain their frames."""
OF_THE_FRAME = frozenset({"dark", "fogged", "blinded", "snow", "out-of-focus"})
"""Causes for which a frame shows nothing by any pose. That of a blocked view may be the ground that a wrong pose takes
for the field."""


@dataclass(frozen=True)
class CheckedCamera:
    """Camera of a file beside the camera that its frame shows.

    `pitch`: the field on which it was calibrated; `given`: as the file has it, its lens for the frame's size;
    `reading`: the convention in which it fits; `meant`: the camera of that reading; `found`: as it was calibrated, None
    if it was not; `refusal`: why it was not; `is_resized`: True if the lens was for pictures of another resolution,
    `is_reordered` if its coefficients were in another order than OpenCV's; `searched`: the search that found it, None
    if it stands where the file puts it; `explained`: share of the paint in the frame, 0..1, on the markings as the file
    puts them, None where little paint is seen.
    """

    pitch: Field
    given: Camera
    has_pose: bool
    reading: Reading
    meant: Camera
    found: CameraResult | None
    refusal: str | None
    is_resized: bool = False
    is_reordered: bool = False
    searched: Search | None = None
    explained: float | None = None

    @property
    def stands(self) -> bool:
        """True if its frame shows it where it was meant to be."""
        return self.found is not None and self.moved_px <= good_within_px(self.meant)

    @property
    def moved_px(self) -> float:
        """Mean shift of the markings in view from where it was meant to be to where it was found, or infinite."""
        assert self.found is not None
        return shift_px(self.pitch, self.meant, self.found.camera)

    @property
    def sigma_px(self) -> float | None:
        """One standard deviation (rms) of the markings in view where it was found; None where nothing tells it."""
        assert self.found is not None
        return None if self.found.ground_sigma is None else self.found.ground_sigma.rms_px

    @property
    def tolerance_px(self) -> float:
        """Largest shift of the markings of a good calibration."""
        return max(good_within_px(self.meant), SURE * (self.sigma_px or 0.0))

    @property
    def is_clearly_wrong(self) -> bool:
        """True if lines are clearly seen, and none of them where the file puts them."""
        return self.explained is not None and self.explained <= 1 - UNEXPLAINED_BY_WEATHER


@dataclass(frozen=True)
class GivenCamera:
    """Camera as a file has it: `camera` with its lens for frames of their size.

    `is_resized`: True if the file has the lens for pictures of another size; `resized`: the lens, if its numbers look
    like those of another resolution than the file says; `has_pose`: False for a lens alone, whose pose says nothing.
    """

    camera: Camera
    is_resized: bool = False
    resized: Lens | None = None
    reordered: Lens | None = None
    has_pose: bool = True


def check_cameras(
    pitch: Field,
    given: Sequence[GivenCamera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    seed: int = 0,
    report: Callable[[Progress], None] = lambda _: None,
) -> list[CheckedCamera]:
    """Return for each camera of a file how its frames `frames[camera.id]` show it. Deterministic for a `seed`."""
    progress = ProgressReporter(report, lambda: False)
    checker = _Checker(pitch, {one.camera.id: one for one in given}, frames, segment, seed)
    progress.at_fraction("refinement", 0.0)
    checker.calibrate_as(TAKEN_AT_ITS_WORD, resized=False)
    checker.calibrate_reordered()
    checker.calibrate_on_fitted_field()
    progress.at_fraction("segmentation", READINGS_AT)
    for reading, resized in checker.likeliest_readings():
        checker.calibrate_as(reading, resized=resized)
    progress.at_fraction("evolution", SEARCH_AT)
    checker.calibrate_turned()
    checker.search()
    checker.settle_near()
    return [checker.result(one.camera.id) for one in given]


def good_within_px(camera: Camera) -> float:
    """Return the mean shift of the markings up to which a calibration is good: a line counts as found so far off."""
    return max(TOLERANCE_PX * camera.intrinsics.relative_size, 2.0)


@dataclass
class _Checker:
    """Course of a check: the cameras that are `settled`, and why the others are not (`refusals`).

    `near`: those whose frames show their lines where the file at its word leads, not exactly enough to be stored.
    """

    pitch: Field
    given: Mapping[str, GivenCamera]
    frames: Mapping[str, Sequence[Frame]]
    segment: Segment
    seed: int
    settled: dict[str, CheckedCamera] = field(default_factory=dict)
    refusals: dict[str, str] = field(default_factory=dict)
    unusable: set[str] = field(default_factory=set)
    near: dict[str, CheckedCamera] = field(default_factory=dict)
    _responses: dict[str, NDArray[np.uint8]] = field(default_factory=dict)

    @property
    def open(self) -> list[GivenCamera]:
        """Cameras that are not settled and whose frames can be used."""
        return [one for id, one in self.given.items() if id not in self.settled and id not in self.unusable]

    @property
    def lost(self) -> list[GivenCamera]:
        """Open cameras whose frames show no lines near where the file puts them."""
        return [one for one in self.open if one.camera.id not in self.near]

    def calibrate_as(self, reading: Reading, *, resized: bool) -> None:
        """Calibrate the open cameras from where a reading of the file puts them, and settle those that are accepted.

        Lines may lie farther from what the file says than from a pose that is to be stored: it is asked where the
        markings are.
        """
        meant = {one.camera.id: self._meant(one, reading, resized) for one in self.open if one.has_pose}
        filming = [camera for camera in meant.values() if films_the_field(self.pitch, camera)]
        for result in self._calibrated(filming, "never"):
            id = result.camera.id
            checked = self._checked(id, reading, meant[id], result, resized=resized)
            if result.accepted:
                self.settled[id] = checked
            elif not result.view.usable and result.view.cause in OF_THE_FRAME:
                self.unusable.add(id)
            elif _is_inexact(result):
                if reading is TAKEN_AT_ITS_WORD:
                    self.near[id] = checked
                if checked.moved_px <= checked.tolerance_px and _passes_through_its_lens(result):
                    self.settled[id] = checked

    def calibrate_reordered(self) -> None:
        """Settle the cameras that stand where the file puts them if its coefficients are k1, k2, k3, p1, p2.

        Through a wrong lens a camera seems turned or zoomed: the reading by which it has not moved is meant.
        """
        for id, given in self.given.items():
            if (
                given.reordered is None
                or not given.has_pose
                or id in self.unusable
                or (id in self.settled and self.settled[id].stands)
            ):
                continue
            meant = given.camera.with_lens(given.reordered)
            for result in self._calibrated([meant], "never"):
                reordered = CheckedCamera(
                    self.pitch,
                    given.camera,
                    True,
                    TAKEN_AT_ITS_WORD,
                    meant,
                    result,
                    None,
                    given.is_resized,
                    is_reordered=True,
                )
                if result.accepted and reordered.stands:
                    self.settled[id] = reordered

    def calibrate_on_fitted_field(self) -> None:
        """Calibrate the settled cameras on the field that their lines show, if more of them stand there.

        A crown that nobody told, or a length that is another, looks like cameras that have moved.
        """
        settled = self.settled.values()
        standing = sum(one.stands for one in settled)
        if standing == len(settled):
            return
        found = [one.found.camera for one in settled if one.found is not None]
        fitted = fit_field(self.pitch, found, {one.id: self.frames[one.id] for one in found}, self.segment, self.seed)
        if fitted.rejected_because is not None or not any(measure.known for measure in fitted.measures):
            return
        there = {
            result.camera.id: replace(self.settled[result.camera.id], pitch=fitted.pitch, found=result)
            for result in self._calibrated([one.meant for one in settled], "never", fitted.pitch)
            if result.accepted
        }
        if sum(one.stands for one in there.values()) > standing:
            self.settled |= there

    def calibrate_turned(self) -> None:
        """Calibrate the open cameras where they stand, whatever way they look."""
        cameras = [one.camera for one in self.lost if one.has_pose and films_the_field(self.pitch, one.camera)]
        for result in self._calibrated(cameras, "accept"):
            if result.accepted:
                id = result.camera.id
                self.settled[id] = self._checked(id, TAKEN_AT_ITS_WORD, self.given[id].camera, result)

    def search(self) -> None:
        """Search for the open cameras: zoomed where they stand, anywhere unless they are near, through another lens."""
        ways: dict[Search, Callable[[GivenCamera], SoughtCamera | None]] = {
            "zoomed": self._zoomed,
            "anywhere": self._anywhere,
            "lens": self._through_another_lens,
        }
        for way, tried in ways.items():
            sought = [one for one in (tried(given) for given in self.open) if one is not None]
            if not sought:
                continue
            frames = {one.id: self.frames[one.id] for one in sought}
            searched = find_cameras(self.pitch, sought, [], frames, self.segment, self.seed)
            found = [one.candidates[0].camera for one in searched.cameras if one.accepted]
            for result in self._calibrated(found, "never"):
                if result.accepted:
                    given = self.given[result.camera.id].camera
                    self.settled[given.id] = self._checked(given.id, TAKEN_AT_ITS_WORD, given, result, searched=way)

    def settle_near(self) -> None:
        """Settle the open cameras that are near where the file puts them: nothing explains their frames better."""
        for one in self.open:
            checked = self.near.get(one.camera.id)
            if checked is not None and checked.found is not None and _passes_through_its_lens(checked.found):
                self.settled[one.camera.id] = checked

    def result(self, id: str) -> CheckedCamera:
        """Return the answer for a camera."""
        if id in self.settled:
            return self.settled[id]
        given = self.given[id]
        explained = None
        if id not in self.unusable:
            paint = Paint.of(self._response(id))
            if len(paint.middles) >= LEAST_PAINT:
                explained = paint.explained_by(self.pitch, given.camera) if given.has_pose else None
        return CheckedCamera(
            self.pitch,
            given.camera,
            given.has_pose,
            TAKEN_AT_ITS_WORD,
            given.camera,
            None,
            self.refusals.get(id),
            given.is_resized,
            explained=explained,
        )

    def likeliest_readings(self) -> Iterator[tuple[Reading, bool]]:
        """Yield the readings, and whether with resized lenses, by which the open cameras are calibrated next.

        By their lines in all colours first; then by each paint on the floor, since those of other sports hide the
        field's.
        """
        for sights, resized in product((self._sight, self._sights_by_paint), (False, True)):
            cameras = [one for one in self.open if one.has_pose and (one.resized is not None or not resized)]
            if not cameras:
                continue
            meant = [self._meant(one, TAKEN_AT_ITS_WORD, resized) for one in cameras]
            ranked = rank_readings(self.pitch, meant, sights(meant), self.seed)
            # At its word the file was tried already, but not with a resized lens.
            for reading in [one for one in ranked if resized or one.causes][:CALIBRATED]:
                if self.open:
                    yield reading, resized

    def _sight(self, cameras: Sequence[Camera]) -> Iterator[list[LineView]]:
        """Yield the views of cameras in all colours."""
        yield _views(cameras, [self._response(one.id) for one in cameras])

    def _sights_by_paint(self, cameras: Sequence[Camera]) -> Iterator[list[LineView]]:
        """Yield the views of cameras in each of several paints."""
        paints = FloorPaints.of([self.frames[one.id][0] for one in cameras], self.segment)
        if paints.are_several:
            yield from (_views(cameras, responses) for responses in paints.responses_by_paint())

    def _response(self, id: str) -> NDArray[np.uint8]:
        """Return the network's response (H, W) to the first frame of a camera."""
        if id not in self._responses:
            self._responses[id] = self.segment(self.frames[id][0], whole_frame(self.given[id].camera.intrinsics.size))
        return self._responses[id]

    def _calibrated(
        self, cameras: Sequence[Camera], recover: Recover, pitch: Field | None = None
    ) -> Sequence[CameraResult]:
        """Return the results of cameras on the given field, or another; none if they see no markings."""
        if not cameras:
            return []
        options = Options(seed=self.seed, recover=recover, lens_may_drift=True)
        try:
            found = calibrate(
                pitch or self.pitch, cameras, {one.id: self.frames[one.id] for one in cameras}, self.segment, options
            )
        except CalibrationError as error:
            self.refusals.setdefault(error.camera, error.detail)
            return []
        for result in found.cameras:
            if result.rejected_because is not None:
                self.refusals.setdefault(result.camera.id, result.rejected_because)
        return found.cameras

    def _checked(
        self,
        id: str,
        reading: Reading,
        meant: Camera,
        found: CameraResult,
        *,
        resized: bool = False,
        searched: Search | None = None,
    ) -> CheckedCamera:
        given = self.given[id]
        is_resized = given.is_resized or (resized and given.resized is not None)
        return CheckedCamera(
            self.pitch, given.camera, given.has_pose, reading, meant, found, None, is_resized, searched=searched
        )

    def _meant(self, given: GivenCamera, reading: Reading, resized: bool) -> Camera:
        half_sides = np.array([self.pitch.length, self.pitch.width]) / 2
        camera = given.camera
        if resized and given.resized is not None:
            camera = camera.with_lens(given.resized)
        return camera.with_pose(reading.pose(camera.pose, half_sides))

    def _zoomed(self, given: GivenCamera) -> SoughtCamera | None:
        if not given.has_pose or not films_a_field(given.camera.pose):
            return None
        lens = SoughtLens.around(given.camera.intrinsics, ZOOM_UNCERTAIN)
        place = Place(position=given.camera.pose.position, radius_m=ON_ITS_MOUNT_M)
        return SoughtCamera(given.camera.id, [lens], place, roll_sigma_deg=KNOCKED_ROLL_DEG)

    def _anywhere(self, given: GivenCamera) -> SoughtCamera | None:
        if given.camera.id in self.near:
            return None
        return SoughtCamera(given.camera.id, [SoughtLens.known(given.camera.intrinsics)], ANYWHERE)

    def _through_another_lens(self, given: GivenCamera) -> SoughtCamera | None:
        if not given.has_pose or not films_a_field(given.camera.pose):
            return None
        place = Place(position=given.camera.pose.position, radius_m=ON_ITS_MOUNT_M)
        return SoughtCamera(given.camera.id, unknown_lenses(given.camera.intrinsics.size), place)


def _is_inexact(result: CameraResult) -> bool:
    """True if a pose explains its frame and is refused for how exactly."""
    return result.is_explained and result.refusal is not None and result.refusal.reason in INEXACT


def _passes_through_its_lens(result: CameraResult) -> bool:
    """True if nothing speaks against a pose but that its lines would fit better through a slightly other lens."""
    return alone_rejection(replace(result, residual_px=0.0, zoom=None)) is None


def _views(cameras: Sequence[Camera], responses: Sequence[NDArray[np.uint8]]) -> list[LineView]:
    """Return the views of cameras in the responses (H, W) of the network, of any size."""
    return [
        LineView.of(response, camera.intrinsics, KNOCKED_ROLL_DEG)
        for camera, response in zip(cameras, responses, strict=True)
    ]
