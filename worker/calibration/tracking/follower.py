"""Tracker of an installation's cameras through a clip: lines frame by frame, the filter over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.detection.contrast import Channels, PixelReader
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.field import Field
from worker.calibration.records import CalibrationError
from worker.calibration.refinement.refine import SEARCH_PX as REFINEMENT_SEARCH_PX
from worker.calibration.refinement.refine import Observations, refine
from worker.calibration.refinement.uncertainty import Sigma
from worker.calibration.tracking.line_observations import Sighting, TrackedLines
from worker.calibration.tracking.motion_filter import GATE, FilterStep, State, smoothed

How = Literal["measured", "coasted", "refused"]


@dataclass(frozen=True)
class TrackedPose:
    """Pose of a camera for one frame.

    `how`: `measured` by its lines; `coasted` along its motion because they were not looked for or not seen; or
    `refused` because they contradicted all that was known, or each other. `motion_covariance` (6, 6) of turn (rad) and
    shift (m): of the motion since the reference; `covariance`: with that of the reference.
    """

    camera: Camera
    how: How
    motion_covariance: Array
    covariance: Array

    @property
    def sigma(self) -> Sigma:
        """Standard deviation of the pose."""
        return Sigma.from_covariance(self.covariance)

    @property
    def motion_sigma(self) -> Sigma:
        """Standard deviation of the motion."""
        return Sigma.from_covariance(self.motion_covariance)


@dataclass(frozen=True)
class TrackedMoment:
    """Poses of all cameras for the frames of this number, from 0."""

    number: int
    cameras: Sequence[TrackedPose]


class CameraTracker:
    """Tracker that takes the frames of a clip one after the other.

    `see` answers each moment at once; `settled` answers it again after `look_ahead` frames more. `cameras`: as stored,
    at most a fraction of a degree off; `first`: the first frames of the clip, by camera. `every`: lines are measured in
    every so many-th frame. Raises `CalibrationError` if the first frame of a camera does not show its lines.
    """

    def __init__(
        self,
        pitch: Field,
        cameras: Sequence[Camera],
        first: Mapping[str, Frame],
        frames_per_second: float,
        every: int = 1,
        look_ahead: int = 0,
    ) -> None:
        self._tracks = [_Track(pitch, *each, first[each[0].id]) for each in _references(pitch, cameras, first)]
        self._seconds = 1 / frames_per_second
        self._every = every
        self._look_ahead = look_ahead
        self._taken = self._since_look = 1
        self._settled = 0

    @property
    def references(self) -> list[Camera]:
        """Cameras at their poses in the first frame, from which motion is counted."""
        return [track.lines.reference for track in self._tracks]

    @property
    def looks(self) -> bool:
        """True if lines are measured in the next frames: where frames were missing, in the first that come."""
        return self._since_look >= self._every

    def see(self, pictures: Mapping[str, PixelReader], seconds: float | None = None) -> TrackedMoment:
        """Take the next pictures; a camera that has none coasts, and so do all where nobody `looks`.

        `seconds`: since the pictures before, where they do not come evenly.
        """
        looked_at = pictures if self.looks else {}
        for track in self._tracks:
            track.see(looked_at.get(track.lines.reference.id), seconds or self._seconds)
        self._since_look = 1 if looked_at else self._since_look + 1
        self._taken += 1
        return self.now

    @property
    def now(self) -> TrackedMoment:
        """Moment of the last frames, by all frames up to it."""
        return TrackedMoment(self._taken - 1, [track.newest() for track in self._tracks])

    def predicted(self, seconds: float) -> TrackedMoment:
        """Return the moment so long after the last frames, should the cameras go on as they go."""
        return TrackedMoment(self._taken - 1, [track.predicted(seconds) for track in self._tracks])

    def settled(self) -> list[TrackedMoment]:
        """Return the moments that enough frames have been seen after, each of them once."""
        return self._settle(self._taken - self._look_ahead)

    def rest(self) -> list[TrackedMoment]:
        """Return the last moments, after the last frames."""
        return self._settle(self._taken)

    def _settle(self, until: int) -> list[TrackedMoment]:
        numbers = range(self._settled, until)
        self._settled = max(self._settled, until)
        return [TrackedMoment(number, [track.oldest() for track in self._tracks]) for number in numbers]


class _Track:
    """Track of one camera."""

    def __init__(self, pitch: Field, reference: Camera, covariance: Array, first: Frame) -> None:
        self.lines = TrackedLines(pitch, reference, first)
        self._covariance = covariance
        sighting = self.lines.sighted(Channels([first]), reference)
        if sighting is None:
            raise _not_seen(reference)
        self.lines.learn(sighting, reference)
        self._last = State.at_reference(self.lines.explained(sighting.seen).observed.information)
        self._steps = [FilterStep(0.0, self._last)]
        self._how: list[How] = ["measured"]
        self._is_refused = False

    def see(self, picture: PixelReader | None, seconds: float) -> None:
        """Take the next picture, so long after the one before; None: it is not looked at, or not there."""
        self.lines.forget(seconds)
        expected = self._last.after(seconds).with_mast_prior(seconds)
        how, self._last = self._known(picture, expected)
        self._steps.append(FilterStep(seconds, self._last))
        self._how.append(how)

    def newest(self) -> TrackedPose:
        """Return the pose for the last frame."""
        return self._followed(self._last, self._how[-1])

    def predicted(self, seconds: float) -> TrackedPose:
        """Return the pose so long after the last frame, with its uncertainty."""
        return self._followed(self._last.after(seconds).with_mast_prior(seconds), self._how[-1])

    def oldest(self) -> TrackedPose:
        """Return the oldest pose that has not settled, smoothed by all frames so far, and forget it."""
        state, how = smoothed(self._steps)[0], self._how[0]
        del self._steps[0], self._how[0]
        return self._followed(state, how)

    def _followed(self, state: State, how: How) -> TrackedPose:
        motion = state.change_covariance
        return TrackedPose(moved(self.lines.reference, state.change), how, motion, self._covariance + motion)

    def _known(self, picture: PixelReader | None, expected: State) -> tuple[How, State]:
        if picture is None:
            return "coasted", expected
        sighting = self._sighted(picture, expected)
        if sighting is None:
            return "coasted", expected
        if expected.squared_innovation(sighting.observed) > GATE or not self.lines.fits(sighting, self._is_refused):
            self._is_refused = True
            return "refused", expected
        self._is_refused = False
        known = expected.with_observed(sighting.observed)
        self.lines.learn(sighting, moved(self.lines.reference, known.change))
        return "measured", known

    def _sighted(self, picture: PixelReader, expected: State) -> Sighting | None:
        """Observe the lines, from where the camera is expected; step by step where that is hardly known."""
        camera = moved(self.lines.reference, expected.change)
        if self._off_px(expected) > 4.0:
            return self.lines.searched(picture, camera)
        return self.lines.sighted(picture, camera)

    def _off_px(self, expected: State) -> float:
        """Return the standard deviation of expected lines, in pixels of a 4K frame."""
        lens = self.lines.reference.intrinsics
        turn = float(np.sqrt(np.trace(expected.change_covariance[:3, :3])))
        return turn * lens.focal_length_px / lens.relative_size


def _references(pitch: Field, cameras: Sequence[Camera], first: Mapping[str, Frame]) -> list[tuple[Camera, Array]]:
    """Return the cameras at their poses in their first frames, and the covariances (6, 6) of these."""
    responses = [np.zeros(first[camera.id].shape[:2], np.float32) for camera in cameras]
    observations = Observations([Channels([first[camera.id]]) for camera in cameras], responses)
    found = []
    # Half width of the first frame's search round by round, in pixels of a 4K frame: it may be taken at the end of a
    # swing.
    for one in refine(pitch, cameras, observations, 0.5, searches_px=(28.0, *REFINEMENT_SEARCH_PX)).each:
        # Least share of lines, beyond chance, that the first frame has to show where the cameras are found.
        if one.covariance is None or one.evidence.agreement < 0.3:
            raise _not_seen(one.camera)
        found.append((one.camera, one.covariance))
    return found


def _not_seen(camera: Camera) -> CalibrationError:
    return CalibrationError(
        camera.id,
        "lines-not-seen",
        f"The first frame of camera {camera.id} does not show its lines near where its stored pose expects them; "
        "calibrate the venue with a frame of this clip first.",
    )
