"""Conversion of the engine's answers to models of the wire, and other parts that the kinds of jobs share."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from math import isfinite, isnan
from typing import Any, Generic, TypeVar

from service.schemas import geometry, venue
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Moved
from service.schemas.job import Progress
from service.schemas.lens_limits import LARGEST_SIGMA, LEAST_SIGMA
from service.schemas.names import refusal_uri
from service.schemas.results import (
    CameraResult,
    CrossCheck,
    MarkingResult,
    PairResult,
    Proposal,
    Provenance,
    SeamPlace,
    Sigma,
    View,
)
from service.schemas.trend import Anchor, Displacement
from worker.calibration import records
from worker.calibration.detection.segmentation import ProviderMissing, Segmenter
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics import seam
from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.gate import quality
from worker.calibration.gate.displacement import measure_displacement
from worker.calibration.gate.pairs import Pair
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.refinement import uncertainty
from worker.calibration.stitching.photometry import Light
from worker.compute_resources import ComputeResources
from worker.jobs.from_schemas import JobFailedError, camera_of

PROVIDERS = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider", "openvino": "OpenVINOExecutionProvider"}
# The engine's report ends with the refinement; what is left is drawing.
PREVIEW_FRACTION = 0.96
# Decimal places of a metre.
MILLIMETRE = 3
R = TypeVar("R", covariant=True)


@dataclass(frozen=True)
class Solution(Generic[R]):
    """A result and the files of its pictures by the names that `service.store.jobs.files.picture_file` knows.

    `later`: names of pictures that can be drawn when somebody looks; `memories`: of the accepted cameras, by camera.
    """

    result: R
    pictures: dict[str, bytes]
    later: Sequence[str] = ()
    memories: Mapping[str, dict[str, Any]] = field(default_factory=dict)


def provenance_of(means: ComputeResources, segmenter: Segmenter, seed: int, options: dict[str, Any]) -> Provenance:
    """Return software, model, seed and options, by which a result can be computed again."""
    return Provenance(software=means.software, model_sha256=segmenter.sha256, seed=seed, options=options)


def round_to_ms(timings_s: Mapping[str, float]) -> dict[str, float]:
    """Return the seconds of each stage, rounded to milliseconds."""
    return {stage: round(seconds, 3) for stage, seconds in timings_s.items()}


def lens_to_schema(lens: Lens) -> Intrinsics:
    """Return a lens of the engine for the wire."""
    # What photos or clicks hardly tell has a deviation beyond any number that says something.
    sigma = {
        name: min(max(value, LEAST_SIGMA), LARGEST_SIGMA) for name, value in lens.sigma.items() if not isnan(value)
    }
    return Intrinsics(
        model=lens.model,
        matrix=lens.matrix.tolist(),
        distortion=lens.distortion.tolist(),
        sigma=sigma or None,
        sigma_from=lens.sigma_from if sigma else None,
    )


def light_to_schema(light: Light) -> geometry.Light:
    """Return a camera's photometric correction for the wire, its colours from red to blue."""
    return geometry.Light(
        gain=[*reversed(light.gain)], contrast=light.contrast, falloff=light.falloff, reach=light.reach
    )


def pose_to_schema(pose: Pose) -> geometry.Pose:
    """Return a pose of the engine for the wire."""
    return geometry.Pose(
        rotation=pose.rotation.tolist(), position=pose.position.tolist(), translation=pose.translation.tolist()
    )


def posed_camera_to_schema(camera: Camera) -> venue.Camera:
    """Return a camera of the engine for the wire, with the lens of its frames, which may be smaller than stored."""
    return venue.Camera(
        id=camera.id,
        image_size=list(camera.intrinsics.size),
        intrinsics=lens_to_schema(camera.intrinsics),
        pose=pose_to_schema(camera.pose),
    )


def ridge_to_schema(pitch: Field) -> list[list[float]] | None:
    """Return the two ends of a pitch's ridge (m, to the millimetre), or None for a flat one."""
    return None if pitch.ridge is None else pitch.ridge.round(MILLIMETRE).tolist()


def field_to_schema(given: FieldOfPlay, pitch: Field) -> FieldOfPlay:
    """Return a field of the wire with the measures of a fitted pitch in millimetres, finer than any of its sigmas."""
    size = {"length_m": round(pitch.length, MILLIMETRE), "width_m": round(pitch.width, MILLIMETRE)}
    return given.changed({**size, "ridge": ridge_to_schema(pitch)})


def finite_or_none(value: Any) -> float | None:
    """Return a number, or None for NaN and infinity, which JSON lacks."""
    return float(value) if value is not None and isfinite(value) else None


def load_segmenter(means: ComputeResources) -> Segmenter:
    """Return the network that the settings name; it is loaded at its first use."""
    if not means.model.is_file():
        raise JobFailedError("model-missing", f"{means.model} is not there; set ESC_MODEL or train one.")
    return Segmenter(means.model, means.threads, PROVIDERS[means.provider])


@contextmanager
def engine_run(report: Callable[[Progress], None]) -> Iterator[Callable[[records.Progress], None]]:
    """Run the engine in the block: yields its progress callback, raises its failures as `JobFailedError`."""
    try:
        yield lambda step: report(_progress_to_schema(step))
    except records.CalibrationError as error:
        raise JobFailedError(error.kind, error.detail, error.camera) from error
    except ProviderMissing as missing:
        raise JobFailedError(
            "provider-missing", f"{missing} Set ESC_PROVIDER=cpu or install what is asked for."
        ) from missing


def _progress_to_schema(step: records.Progress) -> Progress:
    """Return the engine's progress for the wire, with room left for the pictures."""
    return Progress(
        stage=step.stage,
        fraction=min(max(step.fraction, 0.0), PREVIEW_FRACTION),
        generation=step.generation,
        loss=finite_or_none(step.loss),
        expected_end=None if step.remaining_s is None else datetime.now(UTC) + timedelta(seconds=step.remaining_s),
    )


def camera_to_schema(found: quality.CameraResult) -> CameraResult:
    """Return the result of a camera by its refinement alone, without what calibrations add from lights and memories."""
    checked = found.cross_checked()
    return CameraResult(
        id=found.camera.id,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        refusal=None if found.refusal is None else refusal_uri(found.refusal.reason),
        pose=pose_to_schema(found.camera.pose),
        sigma=sigma_to_schema(found.sigma, found.ground_sigma),
        repeatability=sigma_to_schema(found.repeatability),
        moved=_moved(found.moved),
        iou=finite_or_none(found.overlap.iou),
        expected_found=finite_or_none(found.overlap.found),
        unexpected=finite_or_none(found.overlap.unexpected),
        found=finite_or_none(found.evidence.share),
        by_chance=finite_or_none(found.evidence.by_chance),
        confidence=finite_or_none(found.confidence),
        view=_view(found.view),
        residual_px=finite_or_none(found.residual_px),
        markings=[_marking(one) for one in found.markings],
        knocked=found.knocked,
        proposed=_proposal(found),
        cross_check=None if checked is None else CrossCheck(apart_m=checked.apart_m, expected_m=checked.expected_m),
    )


def _moved(found: quality.Moved) -> Moved:
    return Moved(rotation_deg=found.rotation_deg, position_m=found.position_m, pixels=finite_or_none(found.pixels))


def _proposal(found: quality.CameraResult) -> Proposal | None:
    if found.refusal is None or found.refusal.reason != "knocked":
        return None
    return Proposal(
        pose=pose_to_schema(found.camera.pose),
        sigma=sigma_to_schema(found.sigma, found.ground_sigma),
        moved=_moved(found.moved),
        found=finite_or_none(found.evidence.share),
    )


def displacement_to_schema(pitch: Field, found: quality.CameraResult, anchor: Anchor | None) -> Displacement | None:
    """Return the displacement of a camera from its anchor, or from itself without one; None if it is unknown."""
    reference = found.camera if anchor is None else camera_of(anchor.posed)
    moved = measure_displacement(pitch, reference, found)
    if moved is None:
        return None
    turned_and_moved = quality.Moved.between(pitch, reference, found.camera)
    return Displacement(
        anchor=None if anchor is None else anchor.revision,
        at=moved.place[:2].round(2).tolist(),
        across_m=moved.shift[0],
        away_m=moved.shift[1],
        sigma_across_m=moved.sigma[0],
        sigma_away_m=moved.sigma[1],
        repeatability_across_m=moved.repeatability[0],
        repeatability_away_m=moved.repeatability[1],
        rotation_deg=turned_and_moved.rotation_deg,
        position_m=turned_and_moved.position_m,
        focal_length=None if moved.focal is None else moved.focal.value,
        sigma_focal_length=None if moved.focal is None else moved.focal.sigma,
        focal_length_m=moved.focal_shift_m,
    )


def _marking(seen: MarkingReport) -> MarkingResult:
    return MarkingResult(
        name=seen.name,
        expected_m=round(seen.expected_m, 1),
        found=round(seen.found, 3),
        offset_cm=_rounded_cm(seen.offset_m),
        sigma_cm=_rounded_cm(seen.sigma_m),
        side=seen.side,
        elsewhere=seen.is_elsewhere,
    )


def pair_to_schema(pair: Pair, found: seam.Seam) -> PairResult:
    """Return the comparison of two cameras for the wire."""
    return PairResult(
        cameras=list(pair.cameras),
        stitch_error_px=finite_or_none(pair.error_px),
        seam=[_place(place) for place in found.places],
        worst=None if found.worst is None else _place(found.worst),
    )


def _place(place: seam.SeamPlace) -> SeamPlace:
    return SeamPlace(
        at=(place.at.round(1) + 0.0).tolist(),
        across=(place.across.round(2) + 0.0).tolist(),
        error_cm=round(100 * place.error_m, 1),
        sigma_cm=round(100 * place.sigma_m, 1),
    )


def _rounded_cm(metres: float | None) -> float | None:
    """Return a length in centimetres, rounded to the millimetre."""
    return None if metres is None or not isfinite(metres) else round(100 * metres, 1)


def _view(found: ViewCondition) -> View:
    return View(
        usable=found.usable,
        cause=found.cause,
        where=found.where,
        detail=found.words,
        lines_found=finite_or_none(found.figures.lines_found),
        blur_px=finite_or_none(found.figures.blur_px),
    )


def sigma_to_schema(sigma: uncertainty.Sigma | None, ground: uncertainty.GroundSigma | None = None) -> Sigma | None:
    """Return a standard deviation of the engine for the wire, or None if the pose is not determined.

    `ground`: that of the markings in view, where it is known.
    """
    if sigma is None or not isfinite(sigma.rotation_deg) or not isfinite(sigma.position_m):
        return None
    ground_m = None if ground is None else finite_or_none(ground.largest_m)
    return Sigma(rotation_deg=sigma.rotation_deg, position_m=sigma.position_m, ground_m=ground_m)
