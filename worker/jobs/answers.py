"""The result of a calibration as plain records: dictionaries that are written as JSON, and that its parent checks.

They are the wire's models, field by field and under the same names, which a test holds them to. The models themselves
take longer to load than a near job takes to refine a camera.
"""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict


class Pose(TypedDict):
    """See `service.schemas.geometry.Pose`."""

    rotation: list[float]
    position: list[float]
    translation: list[float]


class Intrinsics(TypedDict):
    """See `service.schemas.geometry.Intrinsics`."""

    model: str
    matrix: list[list[float]]
    distortion: list[float]
    sigma: dict[str, float] | None
    sigma_from: str | None


class Light(TypedDict):
    """See `service.schemas.geometry.Light`."""

    gain: list[float]
    contrast: float
    falloff: float
    reach: float


class Moved(TypedDict):
    """See `service.schemas.geometry.Moved`."""

    rotation_deg: float
    position_m: float
    pixels: float | None


class Sigma(TypedDict):
    """See `service.schemas.results.Sigma`."""

    rotation_deg: float
    position_m: float


class View(TypedDict):
    """See `service.schemas.results.View`."""

    usable: bool
    cause: str | None
    where: str | None
    detail: str
    lines_found: float | None
    blur_px: float | None


class MarkingResult(TypedDict):
    """See `service.schemas.results.MarkingResult`."""

    name: str
    expected_m: float
    found: float
    offset_cm: float | None
    sigma_cm: float | None
    side: str | None
    elsewhere: bool


class Refined(TypedDict):
    """See `service.schemas.results.Refined`."""

    pose: Pose
    intrinsics: Intrinsics
    covariance: list[list[float]] | None
    sigma: Sigma | None
    longer: float
    differs_m: float | None


class LensChange(TypedDict):
    """See `service.schemas.results.LensChange`; `since` as ISO 8601."""

    longer: float
    sigma: float
    since: str | None
    words: str | None


class Proposal(TypedDict):
    """See `service.schemas.results.Proposal`."""

    pose: Pose
    sigma: Sigma | None
    moved: Moved
    found: float | None


class CrossCheck(TypedDict):
    """See `service.schemas.results.CrossCheck`."""

    apart_m: float
    expected_m: float


class Displacement(TypedDict):
    """See `service.schemas.trend.Displacement`."""

    anchor: int | None
    at: list[float]
    across_m: float
    away_m: float
    sigma_across_m: float
    sigma_away_m: float
    repeatability_across_m: float
    repeatability_away_m: float
    rotation_deg: float
    position_m: float
    focal_length: float | None
    sigma_focal_length: float | None
    focal_length_m: float


class CameraResult(TypedDict):
    """See `service.schemas.results.CameraResult`."""

    id: str
    accepted: bool
    rejected_because: str | None
    refusal: str | None
    pose: Pose
    intrinsics: Intrinsics | None
    sigma: Sigma | None
    repeatability: Sigma | None
    moved: Moved
    iou: float | None
    seen_by_network: str | None
    expected_found: float | None
    unexpected: float | None
    found: float | None
    by_chance: float | None
    residual_px: float | None
    light: Light | None
    view: View | None
    refined: Refined | None
    lens_change: LensChange | None
    cross_check: CrossCheck | None
    nights: int
    markings: list[MarkingResult]
    knocked: bool
    proposed: Proposal | None
    displacement: Displacement | None


class SeamPlace(TypedDict):
    """See `service.schemas.results.SeamPlace`."""

    at: list[float]
    across: list[float]
    error_cm: float
    sigma_cm: float


class PairResult(TypedDict):
    """See `service.schemas.results.PairResult`."""

    cameras: list[str]
    stitch_error_px: float | None
    seam: list[SeamPlace]
    worst: SeamPlace | None


class Provenance(TypedDict):
    """See `service.schemas.results.Provenance`."""

    software: str
    model_sha256: str
    seed: int
    options: dict[str, Any]


class Suspicion(TypedDict):
    """See `service.schemas.results.Suspicion`."""

    camera: str | None
    quantity: str
    deviation: float
    sigma: float
    detail: str


class AdoptableNumber(TypedDict):
    """See `service.schemas.results.AdoptableNumber`."""

    name: str
    given: float
    value: float
    sigma: float
    moves_m: dict[str, float]


class Result(TypedDict):
    """See `service.schemas.results.Result`."""

    verdict: str
    accepted: bool
    rejected_because: str | None
    cameras: list[CameraResult]
    ridge: list[list[float]] | None
    diagnosis: list[Suspicion]
    adoptable: list[AdoptableNumber]
    warnings: list[str]
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    stitch_error_limit_px: float | None
    pairs: list[PairResult]
    loss: float | None
    generations: int
    path: str
    timings_s: dict[str, float]
    cpu_s: dict[str, float]
    provenance: Provenance


class Progress(TypedDict):
    """See `service.schemas.job.Progress`."""

    stage: str
    fraction: float
    generation: NotRequired[int | None]
    loss: NotRequired[float | None]
    expected_end: NotRequired[str | None]


class JobError(TypedDict):
    """See `service.schemas.job.JobError`."""

    type: str
    title: str
    detail: str
    camera: str | None
