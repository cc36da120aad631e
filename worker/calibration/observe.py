"""Observation: what the frames show, and when the network looks at them.

The near path needs no network: lines are measured in the frames themselves. It stays a witness of every job, at what a
witness costs: an overview of each frame, which must not show that most of the lines on the pitch are elsewhere. It
looks at a frame in full where lines do not suffice.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.exclusions import of_use
from worker.calibration.detection.frame_fusion import Sway, median, sways
from worker.calibration.detection.paint import draw_colours
from worker.calibration.detection.sampling import reduce_by_area
from worker.calibration.detection.segmentation import Region, overview, reachable_regions, whole_frame
from worker.calibration.detection.view_condition import UsualView, ViewCondition, look_at
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.quality import in_one_sentence
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.problem import ObservedCameras, Problem
from worker.calibration.records import CalibrationError, ProgressReporter, Segment
from worker.calibration.refinement.refine import Observations
from worker.calibration.steps import CAPTURE_RAD

FEWEST_VISIBLE_POINTS = 60
"""Line points (25 cm apart) a stored pose has to see; less cannot fix a pose."""
NOTHING_USUAL: Mapping[str, UsualView] = MappingProxyType({})


@dataclass(frozen=True)
class FrameObserver:
    """The frames of a calibration: `frames[camera.id]` of `cameras` around a `pitch`, and the network `segment`.

    `swayed[camera.id]`: shifts of the several frames of a camera.
    """

    pitch: Field
    cameras: Sequence[Camera]
    frames: Mapping[str, Sequence[Frame]]
    swayed: Mapping[str, Sequence[Sway]]
    segment: Segment

    @classmethod
    def of(
        cls, pitch: Field, cameras: Sequence[Camera], frames: Mapping[str, Sequence[Frame]], segment: Segment
    ) -> "FrameObserver":
        """Measure how the frames of each camera lie beside each other."""
        swayed = {camera.id: sways(frames[camera.id], camera.intrinsics) for camera in cameras}
        return cls(pitch, cameras, frames, swayed, segment)

    def observe(self, progress: ProgressReporter, usual: Mapping[str, UsualView] = NOTHING_USUAL) -> ObservedCameras:
        """Measure the view conditions, before the network has looked at anything. Raises `CalibrationError`."""
        blind = cameras_without_markings(self.pitch, self.cameras)
        progress.at("segmentation", 0.0)
        with progress.timed("view"):
            views = [
                replace(view, usable=False, cause="no-markings-in-view", where=None, words=blind[camera.id])
                if camera.id in blind
                else view
                for camera in self.cameras
                for view in [view_of(self.frames[camera.id], self.pitch, camera, usual.get(camera.id))]
            ]
        return self._unseen_by_network(views)

    def _unseen_by_network(self, views: Sequence[ViewCondition]) -> ObservedCameras:
        channels = [Channels(self.frames[camera.id], self.swayed[camera.id]) for camera in self.cameras]
        return ObservedCameras(views, Observations.of_lines_alone(channels), [None] * len(channels), frozenset())

    def seen_in(self, problem: Problem) -> Problem:
        """Return a problem of the same views with these frames, before the network has looked at anything."""
        return replace(problem, observed=self._unseen_by_network(problem.observed.views))

    def regions_of_lines(self, camera: Camera) -> list[Region]:
        """Return where in the frames of a camera, or in reduced ones, lines can be, as far as its pose may be off."""
        return reachable_regions(self.pitch, camera, CAPTURE_RAD * camera.intrinsics.focal_length_px)

    def reduced(self, width: int) -> "FrameObserver":
        """Return the observer of the first frame of each camera, at most so wide."""
        cameras = [camera.resized(min(width, camera.intrinsics.size[0])) for camera in self.cameras]
        frames = {}
        for camera in cameras:
            frames[camera.id] = [reduce_by_area(self.frames[camera.id][0], camera.intrinsics.size)]
        return FrameObserver.of(self.pitch, cameras, frames, self.segment)

    def in_colours(self, colours: Array, choices: Sequence[Sequence[int]]) -> "list[FrameObserver]":
        """Return for each of the `choices` an observer of the first frames that shows only these `colours` of lines.

        All frames of a job may fill half of its memory.
        """
        drawn = {name: draw_colours(its[0], colours, choices) for name, its in self.frames.items()}
        return [
            FrameObserver.of(self.pitch, self.cameras, {name: [its[n]] for name, its in drawn.items()}, self.segment)
            for n in range(len(choices))
        ]

    def with_overviews(self, problem: Problem, progress: ProgressReporter) -> Problem:
        """Return the problem with what the network sees in overviews of the first frames of all cameras.

        Of those that it has looked at, none is needed.
        """
        overviews = list(problem.observed.overviews)
        unseen = [n for n, seen in enumerate(overviews) if seen is None and n not in problem.observed.in_full]
        with progress.timed("segmentation"):
            for n in unseen:
                frame = overview(self.frames[self.cameras[n].id][0])
                camera = self.cameras[n].resized(frame.shape[1])
                response = self.segment(frame, self.regions_of_lines(camera)).astype(np.float32)
                overviews[n] = of_use(camera.ignored, response / np.float32(255))
        return replace(problem, observed=replace(problem.observed, overviews=overviews))

    def look_in_full(self, problem: Problem, numbers: Collection[int], progress: ProgressReporter) -> Problem:
        """Return the problem with the network's responses (H, W) to all frames of some cameras, fused."""
        numbers = [n for n in numbers if n not in problem.observed.in_full]
        responses = list(problem.observed.observations.responses)
        total = sum(len(self.frames[self.cameras[n].id]) for n in numbers)
        done = 0
        with progress.timed("segmentation"):
            for n in numbers:
                camera = self.cameras[n]
                regions = self.regions_of_lines(camera)
                seen = []
                for frame in self.frames[camera.id]:
                    progress.at("segmentation", done / total)
                    seen.append(self.segment(frame, regions))
                    done += 1
                responses[n] = of_use(camera.ignored, median(seen, self.swayed[camera.id]) / np.float32(255))
        observations = replace(problem.observed.observations, responses=responses)
        in_full = frozenset([*problem.observed.in_full, *numbers])
        return replace(problem, observed=replace(problem.observed, observations=observations, in_full=in_full))

    def response_everywhere(self, camera: Camera) -> Response:
        """The network's response (H, W) to all of the frames of a camera, not only where its stored pose has lines."""
        everywhere = whole_frame(camera.intrinsics.size)
        seen = [self.segment(frame, everywhere) for frame in self.frames[camera.id]]
        return of_use(camera.ignored, median(seen, self.swayed[camera.id]) / np.float32(255))


def cameras_without_markings(pitch: Field, cameras: Sequence[Camera]) -> dict[str, str]:
    """Return what to say of each camera whose stored pose sees no pitch: nothing that follows could find it.

    Raises `CalibrationError` where that is so of all of them.
    """
    lines = pitch.line_points()
    blind = {}
    for camera in cameras:
        visible = len(VisibleLines.from_camera(lines, camera))
        if visible < FEWEST_VISIBLE_POINTS:
            blind[camera.id] = (
                f"the stored pose of camera {camera.id} sees {visible * lines.spacing:.0f} m of markings, at least "
                f"{FEWEST_VISIBLE_POINTS * lines.spacing:.0f} m are needed; store a first pose that looks at the pitch"
            )
    if len(blind) == len(cameras):
        raise CalibrationError(next(iter(blind)), "no-markings-in-view", in_one_sentence(list(blind.values())))
    return blind


def view_of(frames: Sequence[Frame], pitch: Field, camera: Camera, usual: UsualView | None) -> ViewCondition:
    """Return the view condition of the first usable frame, or that of the first frame if none is."""
    first = look_at(frames[0], pitch, camera, usual)
    later = (look_at(frame, pitch, camera, usual) for frame in frames[1:])
    return first if first.usable else next((view for view in later if view.usable), first)
