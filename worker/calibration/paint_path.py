"""The paint path: lines of several sports are told apart by their colour.

Which paint is the field's is one unknown that all its lines and all cameras share. Where most of what looks like a
line on the field is none of its lines, each colour on the floor is taken for the field's, and the cameras are placed by
frames that show no other: where they stood, and if that tells nothing, where a search finds them. The field has the
colour that most likely shows its lines: it covers them and lies nowhere else, from where the cameras may be. With it go
all colours most of which lie on its lines then: paint in light and in shade, or beside another line. Where another
colour is about as likely with other poses, the frames do not tell, and the field is looked for in all colours.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from worker.calibration.detection.paint import COMPARED_WIDTH_PX, sort_colours
from worker.calibration.detection.segmentation import covered
from worker.calibration.diagnostics.overlap import Overlap, overlap_of
from worker.calibration.gate.confidence import logit
from worker.calibration.gate.quality import MUCH_UNEXPECTED, Moved
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.observe import FrameObserver
from worker.calibration.problem import Problem
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.least_squares import CLUSTER_POINTS
from worker.calibration.steps import network_responses, search_poses

SURE_NATS = float(np.log(1000))
"""By how much the odds of a colour have to be better than those of any other."""


@dataclass(frozen=True)
class _Explanation:
    """Explanation of a problem by `cameras`, in frames that show some colours only."""

    problem: Problem
    cameras: Sequence[Camera]

    @cached_property
    def log_odds(self) -> float:
        """The log odds (nats) of these poses against ones that chance finds, see `log_odds`."""
        return log_odds(self.problem, self.cameras, [one.iou for one in self.overlaps_at(self.cameras)])

    def overlaps_at(self, cameras: Sequence[Camera]) -> list[Overlap]:
        """Return how the lines that are seen cover those of the field, from other poses."""
        seen = map(self.problem.observed.seen_by_network, range(len(cameras)))
        pairs = zip(cameras, seen, strict=True)
        return [overlap_of(self.problem.pitch, one.resized(its.shape[1]), its) for one, its in pairs]


def log_odds(problem: Problem, found: Sequence[Camera], shares: Sequence[float]) -> float:
    """Return how much likelier `found` poses are than ones that chance finds, in nats.

    By the `shares` 0..1 of lines that fit there, of which ten metres are one witness, as they are of sigma, and by how
    far the cameras would have moved, the scale of which may be any (see `priors`).
    """
    lines = problem.pitch.line_points()
    total = 0.0
    for stored, camera, share in zip(problem.cameras, found, shares, strict=True):
        pieces = len(VisibleLines.from_camera(lines, camera)) / CLUSTER_POINTS
        moved = Moved.between(problem.pitch, stored, camera)
        total += pieces * logit(share) - POSE_NUMBERS * np.log(moved.scale)
    return total


Locate = Callable[[Problem, ProgressReporter], Sequence[Camera]]
"""Function that says where the cameras of a problem may stand."""


def at_stored_poses(problem: Problem, _: ProgressReporter) -> Sequence[Camera]:
    """Return the cameras where they are stored."""
    return problem.cameras


def around_stored_poses(problem: Problem, progress: ProgressReporter) -> Sequence[Camera]:
    """Return the cameras where the paper's search finds them around their stored poses."""
    return search_poses(problem, network_responses(problem), progress).cameras


def show_paint_of_field(
    problem: Problem, observer: FrameObserver, locate: Locate, progress: ProgressReporter
) -> FrameObserver | None:
    """Return the frames in which only the paint of the field's lines shows; None where no paint is likelier than all
    others. `locate` places the cameras by what each paint shows."""
    small = observer.reduced(COMPARED_WIDTH_PX)
    first = [small.frames[small.cameras[n].id][0] for n in problem.usable]
    reachable = [small.regions_of_lines(small.cameras[n]) for n in problem.usable]
    colours = sort_colours(first, [covered(its, frame.shape) for its, frame in zip(reachable, first, strict=True)])
    reduced = replace(problem, cameras=small.cameras)
    shown = small.in_colours(colours, [[n] for n in range(len(colours))])
    explained = [_explain(one, reduced, locate, progress) for one in shown]
    best = max(explained, key=lambda one: one.log_odds, default=None)
    if best is None:
        return None
    beside = [np.mean([its.unexpected for its in one.overlaps_at(best.cameras)]) for one in explained]
    chosen = [n for n, share in enumerate(beside) if share < MUCH_UNEXPECTED or explained[n] is best]
    others = [one for n, one in enumerate(explained) if n not in chosen]
    if any(one.log_odds > best.log_odds - SURE_NATS for one in others):
        return None
    (painted,) = observer.in_colours(colours, [chosen])
    return painted


def _explain(observer: FrameObserver, problem: Problem, locate: Locate, progress: ProgressReporter) -> _Explanation:
    problem = observer.with_overviews(observer.seen_in(problem), progress)
    group = problem.of(problem.usable)
    return _Explanation(group, locate(group, progress))
