"""Cameras that shake while they film: the view stands still, the maps follow where the lines say that they are."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import ClassVar

from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import CalibrationError
from worker.calibration.stitching.moving_panorama import VIEW_BORDER, MovingPanorama
from worker.calibration.stitching.panorama import Panorama
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import StitchedView
from worker.calibration.tracking.follower import CameraTracker, How, TrackedMoment
from worker.video.errors import VideoError
from worker.video.yuv_planes import Picture

# Seconds of pictures that are seen before the pose of a moment is reported.
LOOK_AHEAD_S = 1.0
Keep = Callable[[TrackedMoment, Fraction], None]


@dataclass
class MotionSummary:
    """Motion of a camera in a clip: pictures by how its pose was known, and its farthest turn."""

    how: Counter[How] = field(default_factory=Counter)
    farthest_deg: float = 0.0


class TrackedGeometryFactory:
    """Makes the geometry of a clip whose cameras move, and reports their poses. One for each clip.

    `every`: lines are measured in every so many-th picture; `keep`: takes each moment of the clip, and its rate.
    `motions`: of each camera, so far.
    """

    border: ClassVar[float] = VIEW_BORDER

    def __init__(self, every: int, keep: Keep | None = None) -> None:
        self.motions: dict[str, MotionSummary] = {}
        self._every = every
        self._keep = keep
        self._moving: _TrackedGeometry | None = None

    def __call__(
        self, pitch: Field, view: StitchedView, cameras: Sequence[Camera], lights: Mapping[str, Light], rate: Fraction
    ) -> "_TrackedGeometry":
        """Return the geometry of these cameras."""
        self._moving = _TrackedGeometry(pitch, view, cameras, lights, rate, self._every, self._note)
        return self._moving

    def finish(self) -> None:
        """Report the last moments, after the last picture."""
        if self._moving is not None:
            self._moving.finish()

    def _note(self, moments: Sequence[TrackedMoment], references: Sequence[Camera], rate: Fraction) -> None:
        for moment in moments:
            for reference, now in zip(references, moment.cameras, strict=True):
                motion = self.motions.setdefault(reference.id, MotionSummary())
                motion.how[now.how] += 1
                turned = float(rotation_angles_deg(reference.pose.rotation, now.camera.pose.rotation))
                motion.farthest_deg = max(motion.farthest_deg, turned)
            if self._keep is not None:
                self._keep(moment, rate)


@dataclass
class _TrackedGeometry:
    """A geometry (`worker.video.stitch.Geometry`) that follows its cameras from the first pictures on."""

    pitch: Field
    view: StitchedView
    cameras: Sequence[Camera]
    lights: Mapping[str, Light]
    rate: Fraction
    every: int
    report: Callable[[Sequence[TrackedMoment], Sequence[Camera], Fraction], None]
    _follower: CameraTracker | None = field(default=None, init=False)
    _panoramas: dict[frozenset[str], MovingPanorama] = field(default_factory=dict, init=False)

    def at(self, number: int, pictures: Mapping[str, Picture]) -> Panorama:  # noqa: ARG002
        """Return the panorama of the next pictures, of the cameras that have one."""
        if self._follower is None:
            self._follower = self._start_tracking(pictures)
        else:
            measured = pictures if self._follower.looks else {}
            self._follower.see(measured)
        self.report(self._follower.settled(), self._follower.references, self.rate)
        return self._panorama(self._follower, frozenset(pictures))

    def finish(self) -> None:
        """Report the moments that were not reported yet."""
        if self._follower is not None:
            self.report(self._follower.rest(), self._follower.references, self.rate)

    def _start_tracking(self, pictures: Mapping[str, Picture]) -> CameraTracker:
        seen = [camera for camera in self.cameras if camera.id in pictures]
        first = {camera.id: pictures[camera.id].colours for camera in seen}
        ahead = round(LOOK_AHEAD_S * self.rate)
        try:
            return CameraTracker(self.pitch, seen, first, float(self.rate), self.every, ahead)
        except CalibrationError as error:
            raise VideoError(f"--follow: {error.detail}") from None

    def _panorama(self, follower: CameraTracker, shown: frozenset[str]) -> Panorama:
        references = {camera.id: camera for camera in self.cameras}
        references |= {camera.id: camera for camera in follower.references}
        now = references | {one.camera.id: one.camera for one in follower.now.cameras}
        ids = [camera.id for camera in self.cameras if camera.id in shown]
        if shown not in self._panoramas:
            still = [references[camera] for camera in ids]
            self._panoramas[shown] = MovingPanorama(self.pitch, self.view, still, self.lights)
        return self._panoramas[shown].at([now[camera] for camera in ids])
