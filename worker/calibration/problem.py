"""The problem of a calibration and its solution."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.records import NOT_RECORDED, EngineResult, Options, Path, Recorder
from worker.calibration.refinement.refine import Observations
from worker.calibration.refinement.uncertainty import Deviation


@dataclass(frozen=True)
class ObservedCameras:
    """The condition of each camera's view (`views`), and its frames and network response (`observations`).

    `in_full`: numbers of the cameras that the network has looked at in full; of the others it has an empty response,
    and where it was asked for one, `overviews`: its response (h, w) in 0..1 to a reduced frame.
    """

    views: Sequence[ViewCondition]
    observations: Observations
    overviews: Sequence[Response | None]
    in_full: Collection[int]

    def of(self, numbers: Sequence[int]) -> "ObservedCameras":
        """Return the observations of some of the cameras."""
        return ObservedCameras(
            [self.views[n] for n in numbers],
            self.observations.of(numbers),
            [self.overviews[n] for n in numbers],
            [at for at, n in enumerate(numbers) if n in self.in_full],
        )

    def seen(self, number: int) -> tuple[Channels, Response]:
        """Return the channels of the frames of a camera, and the network's response (H, W) to them."""
        return self.observations.channels[number], self.observations.responses[number]

    def seen_by_network(self, number: int) -> Response:
        """Return the network's response (h, w) to the frame of a camera, or else to its overview."""
        overview = self.overviews[number]
        return self.observations.responses[number] if overview is None or number in self.in_full else overview


@dataclass(frozen=True)
class Problem:
    """Inputs of a calibration: a pitch, cameras at their stored poses, and per camera its observations and memory."""

    pitch: Field
    cameras: Sequence[Camera]
    observed: ObservedCameras
    options: Options
    memories: Sequence[CameraMemory | None]
    recorder: Recorder = NOT_RECORDED

    def of(self, numbers: Sequence[int]) -> "Problem":
        """Return the problem of some of the cameras."""
        cameras, memories = [self.cameras[n] for n in numbers], [self.memories[n] for n in numbers]
        return replace(self, cameras=cameras, observed=self.observed.of(numbers), memories=memories)

    @property
    def usable(self) -> list[int]:
        """Numbers of the cameras whose frames can be used."""
        return [n for n, view in enumerate(self.observed.views) if view.usable]


@dataclass(frozen=True)
class PoseSolution:
    """Cameras with refined poses on their pitch, each judged by itself by the gate.

    `begun`: the pose from which each was refined; `together`: numbers of the cameras that were refined jointly, the
    others stand by themselves; `deviations`: what the lines say of lenses and field; `generations` of the search.
    """

    pitch: Field
    begun: list[Camera]
    results: list[CameraResult]
    together: list[int]
    deviations: list[Deviation]
    generations: int


@dataclass(frozen=True)
class Solution:
    """A problem with all that was observed for its solution, the `poses`, what the gate says of them (`judged`), and
    the `path` that led there."""

    problem: Problem
    poses: PoseSolution
    judged: EngineResult
    path: Path
