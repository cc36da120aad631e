"""The finish: all cameras at once onto the measured lines, by a robust Gauss-Newton, and how sure that is.

Found with the poses: how the ground swells, and whatever number of lens or field is left free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.estimate import Estimate, step, unevenness
from worker.calibration.finish.residuals import Unknowns, misfit_px
from worker.calibration.finish.robust import huber_weights, tukey_weights
from worker.calibration.finish.uncertainty import Finished, judged
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field, LinePoints
from worker.calibration.scene.ground import EVEN, MOST_UNEVEN_M, ORDINARY, UNEVEN_M, Ground
from worker.calibration.scene.parameters import Parameter
from worker.calibration.see.contrast import Channels
from worker.calibration.see.evidence import Evidence, evidence_of
from worker.calibration.see.left_out import left_out
from worker.calibration.see.line_measurement import Measurements, measure_lines

SEARCH_PX = (14.0, 8.0, 5.0, 4.0, 3.0, 3.0, 3.0, 3.0)
"""How far from where the pose expects it a line is looked for, round by round, in pixels of a 4K frame.

The last rounds are there for measurements that change with the pose, and end as soon as they do not.
"""
ASSESSING_SEARCH_PX = 8.0
MOST_STEPS = 4
"""Per round."""
MISFIT_FLATTENS_PX = 0.3
"""Error that nothing explains at which the ground is taken for half as uneven as its heights say."""
SETTLED_M = 5e-5
"""Cameras that a step moves less than this are where these measurements lead."""
ARRIVED_M = 1e-4
"""Cameras that a whole round moves less than this have arrived."""


@dataclass(frozen=True)
class Sight:
    """What a finish looks at: per camera the `channels` of its frame and `responses` (H, W), the segmentation 0..1."""

    channels: Sequence[Channels]
    responses: Sequence[NDArray[np.float32]]

    def of(self, numbers: Sequence[int]) -> Sight:
        """That of some of the cameras."""
        return Sight([self.channels[n] for n in numbers], [self.responses[n] for n in numbers])


def refine(
    pitch: Field,
    cameras: Sequence[Camera],
    sight: Sight,
    stitch_weight: float,
    free: Sequence[Parameter] = (),
    searches_px: Sequence[float] = SEARCH_PX,
    stored: Sequence[Camera] | None = None,
    caught: Sequence[Measurements] | None = None,
) -> Finished:
    """Measure the lines and move the cameras onto them, round by round with a narrower search.

    `stored`: where the cameras stood when that was last known, if not where they begin. `free`: numbers of lenses and
    field to be found along with the poses; pitch and cameras come back with them. `caught`: what the first round
    measures, if that is known.
    """
    if stitch_weight == 0 and len(cameras) > 1 and not free:
        return _each_alone(pitch, cameras, sight, stored or cameras, caught)
    unknowns = Unknowns(len(cameras), free, Ground.under(pitch.line_points()))
    here = Estimate.at(pitch, cameras, unknowns)
    for search in searches_px:
        unknowns = unknowns.around(here.pitch, here.lines)
        measured = caught or measure_all(here.on_ground(unknowns), here.cameras, sight, search)
        caught, before = None, here
        # Huber's loss has one minimum, wherever one begins; Tukey's, which outliers do not move, has several. One step
        # towards the nearest of those drops the outliers and still ends in one place (Bickel, 1975).
        here = _down_huber(here, cameras, measured, unknowns, stitch_weight)
        measured = doubted(here, measured)
        here = step(here, cameras, measured, unknowns, stitch_weight, tukey_weights)
        uneven = unevenness(here, measured, unknowns, stitch_weight, EVEN)
        # A lens or a field that is wrong bends lines as a swelling ground does: the more of it, the flatter the ground.
        uneven /= 1 + (max(found.misfit_px for found in measured) / MISFIT_FLATTENS_PX) ** 2
        here = replace(here, uneven_m=min(uneven, MOST_UNEVEN_M))
        if here.farthest_from(before) < ARRIVED_M:
            break
    here = replace(here, uneven_m=unevenness(here, measured, unknowns, stitch_weight, ORDINARY))
    # Judged by a wider search than the last round's, which could not see an error larger than itself.
    return _assessed(here, stored or cameras, sight, unknowns.around(here.pitch, here.lines), stitch_weight)


def _down_huber(
    here: Estimate,
    found: Sequence[Camera],
    measured: Sequence[Measurements],
    unknowns: Unknowns,
    stitch_weight: float,
) -> Estimate:
    """Where Huber's loss of the same measurements is least."""
    for _ in range(MOST_STEPS):
        measured = doubted(here, measured)
        before, here = here, step(here, found, measured, unknowns, stitch_weight, huber_weights)
        if here.farthest_from(before) < SETTLED_M:
            break
    return here


def doubted(here: Estimate, measured: Sequence[Measurements]) -> list[Measurements]:
    """The measurements with the error that neither noise nor paint nor ground explains where the finish stands.

    Lens and field are never quite what they are said to be, by pixels alike near and far. Without it, a far line that a
    wrong lens puts beside itself by ten of its small sigmas would outweigh all near ones.
    """
    return [
        replace(found, misfit_px=misfit_px(here.lines.position, camera, found))
        for camera, found in zip(here.cameras, measured, strict=True)
    ]


def assess(
    pitch: Field,
    cameras: Sequence[Camera],
    sight: Sight,
    stitch_weight: float,
    free: Sequence[Parameter] = (),
    stored: Sequence[Camera] | None = None,
) -> Finished:
    """What the lines say of poses that are left as they are, with everything else; arguments as for `refine`."""
    unknowns = Unknowns(len(cameras), free, Ground.under(pitch.line_points()))
    return _assessed(Estimate.at(pitch, cameras, unknowns), stored or cameras, sight, unknowns, stitch_weight)


def measure_all(lines: LinePoints, cameras: Sequence[Camera], sight: Sight, search_px: float) -> list[Measurements]:
    """The lines of each camera within `search_px` (of a 4K frame) of where its pose expects them."""
    return [
        measure_lines(lines, camera, channels, response, search_px * camera.intrinsics.relative_size)
        for camera, channels, response in zip(cameras, sight.channels, sight.responses, strict=True)
    ]


def _each_alone(
    pitch: Field,
    cameras: Sequence[Camera],
    sight: Sight,
    stored: Sequence[Camera],
    caught: Sequence[Measurements] | None,
) -> Finished:
    """Cameras that need not agree, each on a ground of its own."""
    ends = [
        refine(pitch, [camera], sight.of([n]), 0.0, stored=[stored[n]], caught=caught and [caught[n]])
        for n, camera in enumerate(cameras)
    ]
    deviations = [deviation for end in ends for deviation in end.deviations if deviation.camera is not None]
    return Finished(pitch, [end.each[0] for end in ends], deviations, [])


def _assessed(
    here: Estimate,
    stored: Sequence[Camera],
    sight: Sight,
    unknowns: Unknowns,
    stitch_weight: float,
) -> Finished:
    lines = here.on_ground(unknowns)
    evidence = [
        evidence_of(lines, camera, channels, response, left_out(here.pitch, camera))
        for camera, channels, response in zip(here.cameras, sight.channels, sight.responses, strict=True)
    ]
    measured = doubted(here, _of_seen(measure_all(lines, here.cameras, sight, ASSESSING_SEARCH_PX), evidence))
    # A field that is wrong looks like a ground that swells a lot: judged, it has to be an ordinary ground.
    ordinary = replace(here, uneven_m=min(here.uneven_m, UNEVEN_M))
    finished = judged(ordinary, stored, measured, evidence, unknowns, stitch_weight)
    each = [
        replace(one, measured=its, uneven_m=ordinary.uneven_m) for one, its in zip(finished.each, measured, strict=True)
    ]
    return replace(finished, each=each)


def _of_seen(measured: Sequence[Measurements], evidence: Sequence[Evidence]) -> list[Measurements]:
    """The measurements of markings that are seen: ridges found where a line should be and is not fix no pose."""
    return [found[np.isin(found.points.marking, seen.seen())] for found, seen in zip(measured, evidence, strict=True)]
