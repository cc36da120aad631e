"""The paint path: on a floor of several sports, the lines of one field are told from the others by their colour.

Which paint is the field's is one unknown that all its lines and all cameras share. Where most of what looks like a
line on the field is none of its lines, each colour on the floor is taken for the field's, and the cameras are searched
for in frames that show no other. The field has the colour that covers its lines best and lies nowhere else, and with it
all colours most of which lie on its lines then: paint in light and in shade, or beside another line. Where another
colour does about as well with other poses, the frames do not tell, and the field is looked for in all colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.detection.paint import sort_colours
from worker.calibration.diagnostics.overlap import overlap_of
from worker.calibration.gate.quality import MUCH_UNEXPECTED, CameraResult
from worker.calibration.observe import FrameObserver
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.refine import Observations
from worker.calibration.solve import Problem, judge_each, network_responses, refine_poses, search_poses


@dataclass(frozen=True)
class _Explanation:
    """Where a search in overviews finds the cameras, in frames that show some colours only: `problem` and `results`."""

    problem: Problem
    results: Sequence[CameraResult]

    @property
    def iou(self) -> float:
        """Mean overlap 0..1 of the lines of the field and those that are seen."""
        return _mean([one.overlap.iou for one in self.results])

    def unexpected_at(self, results: Sequence[CameraResult]) -> float:
        """Return the share 0..1 of the lines on the field that is seen beside all of its own, from other poses."""
        seen = map(self.problem.observed.seen_by_network, range(len(results)))
        cameras = [one.camera for one in results]
        pairs = zip(cameras, seen, strict=True)
        return _mean([overlap_of(self.problem.pitch, one.resized(its.shape[1]), its).unexpected for one, its in pairs])


def show_paint_of_field(
    problem: Problem, observer: FrameObserver, results: Sequence[CameraResult], progress: ProgressReporter
) -> FrameObserver | None:
    """Return the frames in which only the paint of the field's lines shows.

    None where no paint explains more of the lines than all colours together did (`results` of the usable cameras), or
    two do so equally well.
    """
    first = [observer.frames[problem.cameras[n].id][0] for n in problem.usable]
    colours = sort_colours(first, [observer.regions_of_lines(n) for n in problem.usable])
    explained = [_search_in(observer.in_colours(colours, [n]), problem, progress) for n in range(len(colours))]
    best = max(explained, key=lambda one: one.iou, default=None)
    if best is None or best.iou <= _mean([one.overlap.iou for one in results]):
        return None
    chosen = [n for n, one in enumerate(explained) if one.unexpected_at(best.results) < MUCH_UNEXPECTED]
    others = [one for n, one in enumerate(explained) if n not in chosen]
    if any(one.iou > best.iou - problem.gate.agreement_loss for one in others):
        return None
    return observer.in_colours(colours, chosen)


def _search_in(observer: FrameObserver, problem: Problem, progress: ProgressReporter) -> _Explanation:
    problem = observer.with_overviews(observer.seen_in(problem), progress)
    group = problem.of(problem.usable)
    found = search_poses(group, network_responses(group), progress)
    by_lines = Observations.of_lines_alone(group.observed.observations.channels)
    refined = refine_poses(group, found.cameras, by_lines, progress)
    return _Explanation(group, judge_each(group, refined, progress))


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
