"""Plans of installations: from a site with cameras that are not mounted yet to sigmas, maps and warnings."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from service.schemas.geometry import Pose as PoseSchema
from service.schemas.plan import (
    CameraMaps,
    DecisiveMarkingResult,
    LineStateName,
    PlaceChange,
    PlanMaps,
    PlannedCameraIn,
    PlannedCameraResult,
    PlannedPairResult,
    PlannedSite,
    PlanPicture,
    PlanResult,
    PlanWarningResult,
    Rows,
    Spread,
    StandIn,
)
from service.schemas.results import Sigma as SigmaSchema
from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.planning.line_state import STATES
from worker.calibration.planning.plan import CameraPlan, PairPlan, Plan, plan
from worker.calibration.planning.stand import (
    Stand,
    field_of_view_deg,
    pan_tilt_deg,
    pinhole,
    pose_by_angles,
    propose_cameras,
)
from worker.calibration.planning.variations import (
    Change,
    DecisiveMarking,
    decisive_markings,
    higher,
    with_more_overlap,
)
from worker.calibration.planning.warnings import REFUSED, PlanWarning, find_warnings
from worker.calibration.refinement.uncertainty import Sigma
from worker.calibration.rendering.plan_maps import COVERAGE, PLACE, RESOLUTION, Scale, plan_map
from worker.jobs.from_schemas import encode_png, ignored_areas_of, lens_of, pitch_of, pose_of

WORST = 0.95
"""Part of the field in view that is at least as good as its "worst" place."""


@dataclass(frozen=True)
class PlanSolution:
    """A plan, and as an answer: its `result` and its `maps` in numbers."""

    plan: Plan
    result: PlanResult
    maps: PlanMaps


def solve(site: PlannedSite, state: LineStateName, hidden: float) -> PlanSolution:
    """Plan the cameras of a site, for lines in a `state` of which players and others hide a share `hidden` 0..1."""
    pitch = pitch_of(site.field)
    planned = plan(pitch, _cameras(pitch, site), STATES[state], hidden)
    warnings = find_warnings(planned)
    decisive = decisive_markings(planned)
    result = PlanResult(
        lines=state,
        hidden=hidden,
        place_m=_spread(planned.place_m, WORST),
        covered=_covered(planned),
        cameras=[_camera_result(planned, number, markings, warnings) for number, markings in enumerate(decisive)],
        pairs=[_pair_result(planned, pair) for pair in planned.pairs],
        warnings=[PlanWarningResult(kind=one.kind, cameras=list(one.cameras), detail=one.words) for one in warnings],
    )
    return PlanSolution(planned, result, _maps(planned))


def draw_field_maps(planned: Plan) -> dict[PlanPicture, bytes]:
    """Draw the maps of all cameras together, PNG files by their names."""
    cameras = [one.camera for one in planned.cameras]
    coverage = np.where(planned.coverage > 0, planned.coverage.astype(float), np.nan)
    maps: dict[PlanPicture, tuple[Array, Scale]] = {
        "place": (planned.place_m, PLACE),
        "pixels-per-metre": (planned.px_per_metre, RESOLUTION),
        "coverage": (coverage, COVERAGE),
    }
    return {name: encode_png(plan_map(planned.pitch, values, cameras, scale)) for name, (values, scale) in maps.items()}


def draw_camera_maps(planned: Plan) -> dict[str, bytes]:
    """Draw the sigma of a player's place by each camera alone, PNG files by their names."""
    return {
        f"place-{one.camera.id}": encode_png(plan_map(planned.pitch, one.place_m, [one.camera], PLACE))
        for one in planned.cameras
    }


def _cameras(pitch: Field, site: PlannedSite) -> list[Camera]:
    """Return the engine's cameras of a site: those that are given, and those proposed for its stands."""
    proposed = [camera for one in site.stands for camera in propose_cameras(pitch, _stand(one))]
    return [*(camera_of(pitch, camera) for camera in site.cameras), *proposed]


def _stand(given: StandIn) -> Stand:
    width, height = given.image_size
    return Stand(given.id, np.array(given.position, dtype=float), given.cameras, (width, height), given.overlap_deg)


def camera_of(pitch: Field, given: PlannedCameraIn) -> Camera:
    """Return the engine's camera of one that is to be mounted."""
    ignored = ignored_areas_of(given.ignore, given.image_size)
    return Camera(given.id, _lens(given), _pose(pitch, given), ignored)


def _lens(given: PlannedCameraIn) -> Lens:
    """Return the lens of a camera; one that nobody has calibrated yet without distortion."""
    if given.intrinsics is not None:
        return lens_of(given.intrinsics, given.image_size)
    width, height = given.image_size
    assert given.pinhole_view_deg is not None
    return pinhole((width, height), given.pinhole_view_deg)


def _pose(pitch: Field, given: PlannedCameraIn) -> Pose:
    if given.pose is not None:
        return pose_of(PoseSchema.from_input(given.pose))
    position = np.array(given.position, dtype=float)
    if given.look_at is not None:
        return Pose.looking_at(position, pitch.lift(np.array(given.look_at)), -given.roll_deg)
    assert given.pan_deg is not None
    assert given.tilt_deg is not None
    return pose_by_angles(position, given.pan_deg, given.tilt_deg, given.roll_deg)


def _covered(planned: Plan) -> dict[int, float]:
    numbers, cells = np.unique(planned.coverage, return_counts=True)
    return {int(number): round(float(share), 4) for number, share in zip(numbers, cells / cells.sum(), strict=True)}


def _camera_result(
    planned: Plan, number: int, decisive: Sequence[DecisiveMarking], warnings: Sequence[PlanWarning]
) -> PlannedCameraResult:
    one = planned.cameras[number]
    refused = any(one.camera.id in warning.cameras and warning.kind in REFUSED for warning in warnings)
    pan_deg, tilt_deg = pan_tilt_deg(one.camera.pose)
    view_deg = field_of_view_deg(one.camera)
    return PlannedCameraResult(
        id=one.camera.id,
        position=one.camera.pose.position.round(3).tolist(),
        pan_deg=round(pan_deg, 2),
        tilt_deg=round(tilt_deg, 2),
        field_of_view_deg=round(view_deg, 2) if isfinite(view_deg) else None,
        image_size=list(one.camera.intrinsics.size),
        calibratable=not refused,
        share_of_field=round(one.share, 4),
        sigma=_sigma(one.sigma),
        refined_sigma=_sigma(one.refined),
        measurement_sigma=_sigma(one.by_measurement),
        place_m=_spread(one.place_m, WORST),
        calibration_m=_spread(one.calibrated_m, WORST),
        px_per_metre=_spread(one.px_per_metre, 1 - WORST),
        px_per_metre_along=_spread(one.px_per_metre_along, 1 - WORST),
        decisive_markings=[result for marking in decisive if (result := _decisive(planned, one, marking))],
        one_metre_higher=_change(higher(planned, number)),
    )


def _decisive(planned: Plan, one: CameraPlan, marking: DecisiveMarking) -> DecisiveMarkingResult | None:
    change = _change(marking.without)
    if change is None:
        # No cell of the map is in view.
        return None
    return DecisiveMarkingResult(
        marking=marking.name, measured_m=_metres_by_name(planned.pitch, one.line_m)[marking.name], without=change
    )


def _pair_result(planned: Plan, pair: PairPlan) -> PlannedPairResult:
    closer = with_more_overlap(planned, pair)
    return PlannedPairResult(
        cameras=[pair.first, pair.second],
        overlap_m2=round(float(pair.seen.sum()) * planned.cell_m2, 1),
        stitch_m=round(pair.stitch_m, 4),
        markings_m=_metres_by_name(planned.pitch, pair.line_m),
        five_degrees_more_m=None if closer is None else round(closer.stitch_m, 4),
    )


def _metres_by_name(pitch: Field, line_m: Array) -> dict[str, float]:
    """Return the lengths of markings (K,) by the name of what each is a part of, without those of nothing."""
    total: dict[str, float] = {}
    for name, metres in zip(pitch.whole_names(), line_m.tolist(), strict=True):
        total[name] = total.get(name, 0.0) + metres
    return {name: round(metres, 1) for name, metres in total.items() if metres > 0}


def _sigma(sigma: Sigma) -> SigmaSchema:
    return SigmaSchema(rotation_deg=round(sigma.rotation_deg, 4), position_m=round(sigma.position_m, 4))


def _spread(values: Array, worst: float) -> Spread | None:
    """Return the median and the quantile `worst` of a map (H, W); None if it is empty."""
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return None
    median, last = np.quantile(known, [0.5, worst]).tolist()
    return Spread(median=round(median, 4), worst=round(last, 4))


def _change(change: Change) -> PlaceChange | None:
    if not np.isfinite(change.after_m):
        return None
    return PlaceChange(before_m=round(change.before_m, 4), after_m=round(change.after_m, 4))


def _maps(planned: Plan) -> PlanMaps:
    return PlanMaps(
        x_m=planned.xy[0, :, 0].round(3).tolist(),
        y_m=planned.xy[:, 0, 1].round(3).tolist(),
        place_m=_rows(planned.place_m),
        px_per_metre=_rows(planned.px_per_metre),
        coverage=planned.coverage.tolist(),
        cameras={
            one.camera.id: CameraMaps(
                place_m=_rows(one.place_m),
                calibration_m=_rows(one.calibrated_m),
                px_per_metre=_rows(one.px_per_metre),
                px_per_metre_along=_rows(one.px_per_metre_along),
            )
            for one in planned.cameras
        },
    )


def _rows(values: Array) -> Rows:
    return [[None if np.isnan(value) else round(value, 4) for value in row] for row in values.tolist()]
