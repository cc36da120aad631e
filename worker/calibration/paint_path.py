"""The paint path: on a floor of several sports, the lines of one field are told from the others by their colour.

Which paint is the field's is one unknown that all its lines and all cameras share. Where most of what looks like a
line on the field is none of its lines, each colour on the floor is taken for the field's, and the cameras are searched
for in frames that show no other. The field has the colour that covers its lines best and lies nowhere else, and with it
all colours most of which lie on its lines then: paint in light and in shade, or beside another line. Where another
colour does about as well with other poses, the frames do not tell, and the field is looked for in all colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from worker.calibration.detection.paint import sort_colours
from worker.calibration.diagnostics.overlap import Overlap, overlap_of
from worker.calibration.gate.quality import MUCH_UNEXPECTED, CameraResult
from worker.calibration.geometry.camera import Camera
from worker.calibration.observe import FrameObserver
from worker.calibration.records import ProgressReporter
from worker.calibration.solve import Problem, network_responses, search_poses

COMPARED_WIDTH_PX = 1280
"""Width of the frames in which colours are compared. Lines are wide enough to show their paint, and which is the
field's is seen in overviews."""


@dataclass(frozen=True)
class _Explanation:
    """Where a search in overviews finds the `cameras`, in frames that show some colours only."""

    problem: Problem
    cameras: Sequence[Camera]

    @cached_property
    def iou(self) -> float:
        """Mean overlap 0..1 of the lines of the field and those that are seen."""
        return _mean([one.iou for one in self.overlaps_at(self.cameras)])

    def overlaps_at(self, cameras: Sequence[Camera]) -> list[Overlap]:
        """Return how the lines that are seen cover those of the field, from other poses."""
        seen = map(self.problem.observed.seen_by_network, range(len(cameras)))
        pairs = zip(cameras, seen, strict=True)
        return [overlap_of(self.problem.pitch, one.resized(its.shape[1]), its) for one, its in pairs]


def show_paint_of_field(
    problem: Problem, observer: FrameObserver, results: Sequence[CameraResult], progress: ProgressReporter
) -> FrameObserver | None:
    """Return the frames in which only the paint of the field's lines shows.

    None where no paint explains more of the lines than all colours together did (`results` of the usable cameras), or
    two do so equally well.
    """
    small = observer.reduced(COMPARED_WIDTH_PX)
    first = [small.frames[small.cameras[n].id][0] for n in problem.usable]
    colours = sort_colours(first, [small.regions_of_lines(n) for n in problem.usable])
    reduced = replace(problem, cameras=small.cameras)
    explained = [_search_in(small.in_colours(colours, [n]), reduced, progress) for n in range(len(colours))]
    best = max(explained, key=lambda one: one.iou, default=None)
    if best is None or best.iou <= _mean([one.overlap.iou for one in results]):
        return None
    beside = [_mean([its.unexpected for its in one.overlaps_at(best.cameras)]) for one in explained]
    chosen = [n for n, share in enumerate(beside) if share < MUCH_UNEXPECTED]
    others = [one for n, one in enumerate(explained) if n not in chosen]
    if any(one.iou > best.iou - problem.gate.agreement_loss for one in others):
        return None
    return observer.in_colours(colours, chosen)


def _search_in(observer: FrameObserver, problem: Problem, progress: ProgressReporter) -> _Explanation:
    problem = observer.with_overviews(observer.seen_in(problem), progress)
    group = problem.of(problem.usable)
    return _Explanation(group, search_poses(group, network_responses(group), progress).cameras)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
