"""What each kind of job finds, and what it is worth."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import Field

from service.schemas.base import OPEN_WORD, Id, Schema
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Light, Moved, Pose, Row
from service.schemas.names import FieldNumber, Verdict
from service.schemas.options import Coordinates, Landmark
from service.schemas.trend import Displacement

NO_CHOICE: Mapping[str, int | None] = MappingProxyType({})
CPU_S: Any = Field(
    {}, description="Core-seconds, of all threads, of the stages that `timings_s` times; {} of earlier releases."
)


class Sigma(Schema):
    """One standard deviation of a pose."""

    rotation_deg: float
    position_m: float


Cause = Literal["dark", "fogged", "blinded", "snow", "out-of-focus", "blocked", "other-camera", "no-markings-in-view"]


class View(Schema):
    """Whether a camera's frame could be used, and what is wrong with it if not."""

    usable: bool
    cause: Annotated[Cause, OPEN_WORD] | None = None
    where: str | None = Field(None, description="Which part of the visible field.")
    detail: str
    lines_found: float | None = Field(
        None, description="Share 0..1 of the expected places on lines at which a line is seen, before any search."
    )
    blur_px: float | None = Field(
        None, description="Of edges, one standard deviation; compared with that of the last accepted job."
    )


Side = Literal["outside", "inside", "right", "left", "far", "near"]


class MarkingResult(Schema):
    """A marking as one camera sees it; dashes of a line, and marks in rows, are one.

    Lines that bound the field, and circles and arcs, have an outside and an inside; else the sides are those of the
    pitch: right (x) and left, far (y) and near.
    """

    name: str
    expected_m: float = Field(description="Length of it that should be in view.")
    found: float = Field(description="Share 0..1 of that length that is seen where the pose puts it.")
    offset_cm: float | None = Field(
        None,
        description="How far its paint lies from where the venue has it, across it on the ground, if all other "
        "markings are in place; positive outside, right or far, else negative. Null where that cannot be told.",
    )
    sigma_cm: float | None = Field(None, description="One standard deviation of that, ten metres of line taken as one.")
    side: Annotated[Side, OPEN_WORD] | None = Field(
        None, description="On which side of its place the paint is: the sign in a word."
    )
    elsewhere: bool = Field(False, description="Beyond three sigma and 3 cm: the paint is off, or a measure.")


class Refined(Schema):
    """A camera's pose and lens as the lines have both, of this night and of those that its memory holds.

    For whoever measures in the world. The camera's `pose` is the one for the lens that the venue has.
    """

    pose: Pose
    intrinsics: Intrinsics = Field(description="The lens; its `sigma` is the root of the diagonal of `covariance`.")
    covariance: list[list[float]] | None = Field(
        description="12x12: rotation in the camera's frame (rad), position (m), focal length (px), principal point x "
        "and y (px), aspect (fy/fx), k1, k2. Null where the lines do not determine it."
    )
    sigma: Sigma | None = Field(description="Of the pose, with what is not known of the lens.")
    longer: float = Field(
        description="How much longer its focal length is than that of the lens of `pose`: 0.001 is 0.1 %."
    )
    differs_m: float | None = Field(
        description="How far apart on the ground the same pixels are by `pose` and by the refined one: the median over "
        "the points in view of the marking that is farthest from the camera, in most views the far touchline. Null "
        "where no marking is in view."
    )


class LensChange(Schema):
    """How a camera's focal length has changed since the first nights of its memory.

    It is longer by `longer` ± `sigma` of itself (0.001 is 0.1 %) than on the day of `since`; null: not known.
    """

    longer: float
    sigma: float
    since: datetime | None
    words: str | None = Field(
        description="The change in words; null while it is within three sigma.",
        examples=["focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus"],
    )


class Proposal(Schema):
    """Where a camera that was knocked was found again, for a person to accept: `POST /jobs/{id}/accept`."""

    pose: Pose
    sigma: Sigma | None
    moved: Moved = Field(description="From the stored pose.")
    found: float | None = Field(description="Share 0..1 of the visible markings' length that is seen there.")


class CrossCheck(Schema):
    """Pose and lens by every second ten metres of the lines, beside pose and lens by the other ones.

    The two put the farthest marking in view `apart_m` apart on the ground. `expected_m`: one standard deviation of
    that by the sigmas of both. Several times as much means that sigma is too small for this camera.
    """

    apart_m: float
    expected_m: float


class CameraResult(Schema):
    """One camera's answer."""

    id: Id
    accepted: bool = Field(description="Whether the gate lets its pose replace the stored one.")
    rejected_because: str | None
    refusal: str | None = Field(
        None,
        description="Where the service explains that reason: what it looks like and what to do.",
        examples=["/refusals/residual"],
    )
    pose: Pose
    intrinsics: Intrinsics | None = Field(None, description="With fit_focal_length: those the pose belongs to.")
    sigma: Sigma | None
    repeatability: Sigma | None = Field(
        None, description="The part of sigma that the lens and the field, the same the next time, have no part in."
    )
    moved: Moved
    iou: float | None = Field(description="Of the expected markings and the network's mask of the pitch, as lengths.")
    seen_by_network: Annotated[Literal["full", "overview"], OPEN_WORD] | None = Field(
        None,
        description="Whether the network looked at the frame in full, or at an overview, because lines that were "
        "measured in the frame sufficed; iou, expected_found and unexpected are of what it saw.",
    )
    expected_found: float | None = Field(
        None, description="One side of the IoU: share 0..1 of the expected markings that the network's mask covers."
    )
    unexpected: float | None = Field(
        None,
        description="The other side: share 0..1 of the mask on the pitch that lies beside all expected markings; much "
        "where another sport's lines are painted, which a field may list as `other_markings`.",
    )
    found: float | None = Field(
        None, description="Share 0..1 of the visible markings' length that is seen where the pose puts it."
    )
    by_chance: float | None = Field(None, description="Share 0..1 of that length that would be seen anywhere.")
    residual_px: float | None
    light: Light | None = Field(
        None, description="How it is evened out with the other accepted cameras in a stitched view; kept with the pose."
    )
    view: View | None = None
    refined: Refined | None = Field(
        None, description="Pose and lens as the lines have both; null where they are not determined."
    )
    lens_change: LensChange | None = Field(None, description="Null before its memory has a night.")
    cross_check: CrossCheck | None = Field(
        None, description="Half of the lines against the other half; null where one half is too short."
    )
    nights: int = Field(
        0, description="Accepted jobs in the camera's memory, this one too where it is accepted and no dry run."
    )
    markings: list[MarkingResult] = Field([], description="What was seen of each marking that should be in view.")
    knocked: bool = Field(
        False,
        description="Whether it was lost and found again, farther from its stored pose than a camera moves by itself.",
    )
    proposed: Proposal | None = Field(
        None, description="Of a knocked camera that is not accepted: the pose that accepting the job stores."
    )
    displacement: Displacement | None = Field(
        None, description="From the camera's anchor, see `GET /venues/{id}/cameras/{camera}/trend`."
    )


class SeamPlace(Schema):
    """A piece of line that two cameras see, around a point `at` [x, y] of the pitch, m.

    The second camera puts its paint `error_cm` ± `sigma_cm` beside where the first does, in the direction `across` the
    line, a unit vector [x, y]. Along the line nothing is measured.
    """

    at: list[float]
    across: list[float]
    error_cm: float
    sigma_cm: float


class PairResult(Schema):
    """Two cameras that were compared."""

    cameras: list[Id]
    stitch_error_px: float | None = Field(
        description="At the centre of the pitch, or of what both see; null where the views cannot be brought together."
    )
    seam: list[SeamPlace] = Field(
        description="All along what both see, by the lines that both have measured, from end to end; at most 24 places."
    )
    worst: SeamPlace | None = Field(
        description="The place of the seam with the largest error, but for those that are hardly measured."
    )


class Provenance(Schema):
    """What it takes to compute the same numbers again."""

    software: str
    model_sha256: str
    seed: int
    options: dict[str, Any]


class Suspicion(Schema):
    """A number of a camera's lens, or of the field (camera null), that the lines contradict.

    It seems to be larger than the venue says by `deviation` ± `sigma`, in the unit that `quantity` ends on.
    """

    camera: Id | None
    quantity: str
    deviation: float
    sigma: float
    detail: str


class AdoptableNumber(Schema):
    """A number of the field that the lines determine and contradict, metres.

    It is `given` in the venue that the job began with, and `value` ± `sigma` by the lines. `POST
    /venues/{id}/adopt-field` stores that value; nothing is stored by itself.
    """

    name: Annotated[FieldNumber, OPEN_WORD]
    given: float
    value: float
    sigma: float
    moves_m: dict[Id, float] = Field(
        {},
        description="About how far the positions of the accepted cameras move with it, by camera: the same lines, "
        "fitted again with that number. The next calibration moves them; storing the number does not.",
    )


class Result(Schema):
    """Poses and what they are worth. Stitch errors: 1 px is 10 cm on the pitch; one camera has none."""

    verdict: Annotated[Verdict, OPEN_WORD] = Field(
        description="Whether the poses of all cameras are accepted, of some or of none."
    )
    accepted: bool = Field(description="Whether those of all cameras are.")
    rejected_because: str | None = Field(description="All reasons, with the cameras they are about.")
    cameras: list[CameraResult]
    ridge: list[Row] | None = Field(None, description="With fit_ridge: as it was found.")
    diagnosis: list[Suspicion] = Field([], description="What the lines say is wrong with what the venue says.")
    adoptable: list[AdoptableNumber] = Field(
        [], description="Of the diagnosis, the numbers of the field, and what storing each would be."
    )
    warnings: list[str] = Field(
        [], description="What the venue leaves to be assumed: lenses without a `sigma`; pictures that are missing."
    )
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    stitch_error_limit_px: float | None = Field(None, description="What the gate lets pass at most.")
    pairs: list[PairResult] = Field([], description="The cameras that were compared, two by two.")
    loss: float | None = Field(description="Of the poses that are answered, by the middle level of the search.")
    generations: int
    path: Annotated[Literal["near", "wide", "anywhere"], OPEN_WORD] = Field(
        "wide",
        description="`near`: the cameras stand almost as stored, and no search was needed. `wide`: a search around the "
        "stored poses. `anywhere`: some camera was lost and found again, where it stood, turned by any angle, or, with "
        "`search` `anywhere`, elsewhere.",
    )
    timings_s: dict[str, float]
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance

    @property
    def recovered_cameras(self) -> list[str]:
        """Ids of the cameras that were knocked and whose new poses may replace the stored ones."""
        return [camera.id for camera in self.cameras if camera.accepted and camera.knocked]

    @property
    def accepted_cameras(self) -> list[str]:
        """Those whose poses may replace the stored ones."""
        return [camera.id for camera in self.cameras if camera.accepted]


class PhotoResult(Schema):
    """What became of a photo. `left_out_px`: how well a lens that was fitted without it foretells its corners (rms)."""

    name: str
    fate: Annotated[Literal["used", "no-board", "wrong-size", "hurts"], OPEN_WORD]
    rms_px: float | None
    left_out_px: float | None
    blurred: bool


class CoverageResult(Schema):
    """How much of the picture the board reached; `empty`: the ninths of it without any corner."""

    share: float
    empty: list[str]


class LensTrial(Schema):
    """A lens that was tried, by its free numbers; rms of the photos it was fitted to and of those it was not."""

    terms: list[str]
    rms_px: float
    left_out_px: float


class IntrinsicsResult(Schema):
    """A lens from photos of a board, and what it is worth.

    `sigma`: one standard deviation of each number if every corner were an independent witness; `spread`: by leaving
    out photos, which is nearer to the truth. `warnings` say what to photograph next.
    """

    image_size: list[int]
    intrinsics: Intrinsics
    terms: list[str]
    rms_px: float
    left_out_px: float
    sigma: dict[str, float]
    spread: dict[str, float]
    coverage: CoverageResult
    photos: list[PhotoResult]
    trials: list[LensTrial]
    warnings: list[str]
    timings_s: dict[str, float]
    software: str


class PointResult(Schema):
    """What became of a click. `exchanged_with`: the point whose label explains it, and it theirs.

    `looks_like`: the named point it is on instead. `residual_px`: null where the camera cannot see its point.
    """

    world: Landmark | Coordinates
    residual_px: float | None
    doubted: bool
    exchanged_with: Landmark | Coordinates | None
    looks_like: str | None


class LensGain(Schema):
    """Numbers of the lens that were fitted to the points because the one given does not fit them.

    `left_out_px`: rms of points, each where a fit to the others puts it. `evidence`: the gain in BIC; 10 is strong.
    """

    given: Intrinsics
    free: list[str]
    sigma: dict[str, float]
    rms_before_px: float
    rms_px: float
    left_out_before_px: float
    left_out_px: float
    evidence: float


class LocateSigma(Schema):
    """One standard deviation of a first pose; `pixels`: of where it puts the clicked points."""

    rotation_deg: float
    position_m: float
    pixels: float


class LocateResult(Schema):
    """A first pose. `accepted`: a calibration can begin with it; `intrinsics` are those that it holds with."""

    accepted: bool
    rejected_because: str | None
    camera: Id
    image_size: list[int]
    intrinsics: Intrinsics
    pose: Pose
    rms_px: float
    sigma: LocateSigma
    points: list[PointResult]
    lens: LensGain | None
    warnings: list[str]
    timings_s: dict[str, float]
    software: str


class MeasureResult(Schema):
    """A measure of the pitch, metres: as the venue has it (`given`) and as the lines have it (`value` ± `sigma`).

    `open`: one standard deviation of what it might have been before. `known`: whether the lines tell it; if not,
    `detail` says why, and the fitted field keeps what was given.
    """

    name: Annotated[Literal["length_m", "width_m", "ridge_height_m", "ridge_length_m"], OPEN_WORD]
    given: float
    value: float
    sigma: float
    open: float
    known: bool
    detail: str


class FieldResult(Schema):
    """A pitch with the measures that its lines tell, and the cameras as they stand around it.

    `accepted`: it may replace the one that the venue has; nothing is replaced by itself.
    """

    accepted: bool
    rejected_because: str | None
    field: FieldOfPlay
    measures: list[MeasureResult]
    cameras: list[CameraResult]
    stitch_error_px: float | None
    warnings: list[str] = Field([], description="Pictures that are missing.")
    timings_s: dict[str, float]
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance


class CandidateResult(Schema):
    """A camera that may have taken the frame. `agreement`: how well the lines agree with it both ways, 0..1: is the
    expected seen, and the seen expected? `lines_found`: the share of the expected that is seen; `residual_px`: rms of
    the measured lines, null where too few were measured.
    """

    intrinsics: Intrinsics
    pose: Pose
    agreement: float
    lines_found: float
    residual_px: float | None
    sigma: Sigma | None


FindReason = Annotated[
    Literal[
        "no-lines",
        "lines",
        "few-lines",
        "implausible",
        "not-unique",
        "not-confirmed",
    ],
    OPEN_WORD,
]


class FoundCameraResult(Schema):
    """Answer of a search for one camera: `candidates`, the best first; where it is accepted, the first is taken."""

    id: Id
    accepted: bool
    reason: FindReason | None = Field(description="Why it is not accepted, in a word.")
    rejected_because: str | None
    remarks: list[str] = Field(
        description="What was assumed, such as the side of a field that looks the same twice; doubts about its lens."
    )
    assumed_side: Annotated[Literal["near", "far", "left", "right"], OPEN_WORD] | None = Field(
        None,
        description="The side that the first candidate stands on by an assumption about all cameras of the search. "
        "Where it is wrong, take the second candidate of each of them, half a turn about the field's centre away.",
    )
    image_size: list[int]
    candidates: list[CandidateResult]


class FindResult(Schema):
    """Cameras found from their frames alone. `accepted`: all of them were.

    Nothing is stored by itself: `POST /venues/{id}/adopt-found` takes what was found.
    """

    accepted: bool
    rejected_because: str | None
    cameras: list[FoundCameraResult]
    ridge: list[Row] | None = Field(
        None,
        description="Of a field that was taken for flat, the ridge that the lines tell; the venue gets it with the "
        "poses. null: they tell none, or the field has one.",
    )
    stitch_error_px: float | None
    warnings: list[str] = Field([], description="Pictures that are missing.")
    timings_s: dict[str, float]
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance

    def chosen(self, choice: Mapping[str, int | None] = NO_CHOICE) -> dict[str, CandidateResult]:
        """The candidate that each camera is taken to be, by camera.

        `choice`: the number of one from 1, or None where none is taken; a camera that it does not name is its first
        candidate if that is accepted.
        """
        first = {camera.id: 1 for camera in self.cameras if camera.accepted}
        candidates = {camera.id: camera.candidates for camera in self.cameras}
        return {camera: candidates[camera][n - 1] for camera, n in {**first, **choice}.items() if n is not None}


AnyResult = Result | IntrinsicsResult | LocateResult | FieldResult | FindResult
