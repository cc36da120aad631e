"""Results of each kind of job, with their uncertainties and verdicts."""

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import Field, computed_field

from service.schemas.base import OPEN_WORD, Id, OpenChoice, Schema
from service.schemas.check import CheckResult
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Light, Moved, Pose, Row
from service.schemas.names import FieldNumber, Verdict, refusal_uri
from service.schemas.options import Coordinates, Landmark
from service.schemas.trend import Displacement

KIND = "Kind of the job, which says what the result has."
NO_CHOICE: Mapping[str, int | None] = MappingProxyType({})
TIMINGS = "Seconds by stage."
CPU_S: Any = Field({}, description="Core-seconds of all threads by stage, as in `timings_s`; {} from earlier releases.")


class Sigma(Schema):
    """One standard deviation of a pose."""

    rotation_deg: float = Field(description="Of the rotation, degrees.")
    position_m: float = Field(description="Of the position, m.")
    ground_m: float | None = Field(
        None,
        description="Of the place on the field that pose and lens give a pixel, at the worst marking in view: what the "
        "gate limits. A long lens may leave its position and focal length open, and know the field well. Null where it "
        "is not computed.",
    )


Cause = Literal["dark", "fogged", "blinded", "snow", "out-of-focus", "blocked", "other-camera", "no-markings-in-view"]


class View(Schema):
    """Usability of a camera's frame, and what is wrong with it."""

    usable: bool = Field(description="True if the frame can be calibrated.")
    cause: Annotated[Cause, OPEN_WORD] | None = Field(
        None,
        description="What is wrong with it, see `GET /refusals/view`; `other-camera` and `no-markings-in-view` are "
        "refusals of their own.",
    )
    where: str | None = Field(None, description="Affected part of the visible field.")
    detail: str = Field(description="The same in words, and what to do.")
    lines_found: float | None = Field(
        None, description="Share 0..1 of sampled points of the expected lines at which a line is seen, before a search."
    )
    blur_px: float | None = Field(
        None, description="Blur of edges, one standard deviation; compared with the last accepted job's."
    )


Side = Literal["outside", "inside", "right", "left", "far", "near"]


class MarkingResult(Schema):
    """A marking as one camera sees it; the dashes of a line, or marks in a row, count as one.

    Boundary lines, circles and arcs have an outside and an inside; other markings have the sides of the pitch: right
    (x) and left, far (y) and near.
    """

    name: str = Field(description="Name of the marking.")
    expected_m: float = Field(description="Length of the marking that should be in view.")
    found: float = Field(description="Share 0..1 of that length that is seen where the pose puts it.")
    offset_cm: float | None = Field(
        None,
        description="Offset of the paint from its place in the venue, across the marking on the ground, if all other "
        "markings are in place; positive outside, right or far, else negative. Null if it cannot be determined.",
    )
    sigma_cm: float | None = Field(
        None, description="One standard deviation of the offset; ten metres of line count as one observation."
    )
    side: Annotated[Side, OPEN_WORD] | None = Field(
        None, description="Side of its place that the paint is on: the sign of the offset in a word."
    )
    elsewhere: bool = Field(
        False, description="True beyond three sigma and 3 cm: the paint or a dimension of the field is wrong."
    )


class Refined(Schema):
    """Pose and lens of a camera, fitted together to the lines of this night and of those in the camera's memory.

    Use it to measure in the world. The camera's `pose` belongs to the stored lens instead.
    """

    pose: Pose
    intrinsics: Intrinsics = Field(description="The lens; its `sigma` is the root of `covariance`'s diagonal.")
    covariance: list[list[float]] | None = Field(
        description="12x12: rotation in the camera's frame (rad), position (m), focal length (px), principal point x "
        "and y (px), aspect (fy/fx), k1, k2. Null if the lines do not determine it."
    )
    sigma: Sigma | None = Field(description="Uncertainty of the pose, including the lens's.")
    longer: float = Field(
        description="Relative difference of its focal length from the lens of the camera's `pose`: 0.001 is 0.1 % more."
    )
    differs_m: float | None = Field(
        description="Distance on the ground between the positions that the camera's `pose` and the refined pose give "
        "the same pixels: the median over the visible points of the farthest marking, mostly the far touchline. Null "
        "if no marking is in view."
    )

    @computed_field(description="The same as `longer`.")  # type: ignore[prop-decorator]
    @property
    def focal_length_change(self) -> float:
        """Relative difference of the focal length."""
        return self.longer


class LensChange(Schema):
    """Change of a camera's focal length since the first nights of its memory."""

    longer: float = Field(description="Relative difference of the focal length: 0.001 is 0.1 % longer.")
    sigma: float = Field(description="One standard deviation of `longer`.")
    since: datetime | None = Field(description="Time that it is compared with; null: unknown.")
    words: str | None = Field(
        description="The change in words; null while it is within three sigma.",
        examples=["focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus"],
    )

    @computed_field(description="The same as `longer`.")  # type: ignore[prop-decorator]
    @property
    def focal_length_change(self) -> float:
        """Relative difference of the focal length."""
        return self.longer

    @computed_field(description="The same as `words`.")  # type: ignore[prop-decorator]
    @property
    def summary(self) -> str | None:
        """The change in a sentence."""
        return self.words


class Proposal(Schema):
    """New pose of a knocked camera, which a person can accept: `POST /jobs/{id}/accept`."""

    pose: Pose
    sigma: Sigma | None
    moved: Moved = Field(description="Movement from the stored pose.")
    found: float | None = Field(description="Share 0..1 of the visible markings' length that is seen by this pose.")


class CrossCheck(Schema):
    """Cross-check of pose and lens: a fit to every second ten metres of the lines against a fit to the others.

    An `apart_m` of several times `expected_m` means that sigma is too small for this camera.
    """

    apart_m: float = Field(
        description="Distance on the ground between the two fits at the farthest marking in view, m."
    )
    expected_m: float = Field(description="One standard deviation of that distance by the sigmas of both, m.")


class CameraResult(Schema):
    """Result of a calibration for one camera."""

    id: Id = Field(description="Id of the camera.")
    accepted: bool = Field(description="True if the quality gate lets its pose replace the stored one.")
    rejected_because: str | None = Field(description="Reason in words if the gate rejects the pose.")
    refusal: str | None = Field(
        None,
        description="Path at which the service explains the reason, and what to do.",
        examples=["/refusals/residual"],
    )
    pose: Pose
    intrinsics: Intrinsics | None = Field(None, description="With fit_focal_length: the lens that the pose belongs to.")
    sigma: Sigma | None
    repeatability: Sigma | None = Field(
        None,
        description="The part of sigma that changes from night to night: without errors of the lens and the field.",
    )
    moved: Moved
    iou: float | None = Field(
        description="Intersection over union of the expected markings and the network's mask, by lengths."
    )
    seen_by_network: Annotated[Literal["full", "overview"], OPEN_WORD] | None = Field(
        None,
        description="Input of the network: the frame in `full`, or an `overview` if lines that were measured in the "
        "frame sufficed. iou, expected_found and unexpected refer to it.",
    )
    expected_found: float | None = Field(
        None, description="Recall: share 0..1 of the expected markings that the network's mask covers."
    )
    unexpected: float | None = Field(
        None,
        description="Share 0..1 of the mask on the pitch that lies off all expected markings; large where lines of "
        "another sport are painted, which a field may list as `other_markings`.",
    )
    found: float | None = Field(
        None, description="Share 0..1 of the visible markings' length that is seen where the pose puts it."
    )
    by_chance: float | None = Field(None, description="Share 0..1 of that length that would be seen by chance.")
    confidence: float | None = Field(
        None,
        description="Probability 0..1 that the pose is the right explanation of the frame, rather than one that other "
        "lines fit by chance; how precise it is, `sigma` says. Null if the frame cannot be used.",
    )
    residual_px: float | None = Field(
        description="Root mean square of the distances from measured lines to the pose's, pixels."
    )
    light: Light | None = Field(
        None,
        description="Photometric correction for stitched views with the other accepted cameras; kept with the pose.",
    )
    view: View | None = None
    refined: Refined | None = Field(
        None, description="Pose and lens fitted together to the lines; null if the lines do not determine both."
    )
    lens_change: LensChange | None = Field(
        None, description="Change of the focal length; null before the camera's memory has a night."
    )
    cross_check: CrossCheck | None = Field(
        None, description="Half of the lines against the other half; null if one half is too short."
    )
    nights: int = Field(
        0, description="Accepted jobs in the camera's memory, with this one if it is accepted and no dry run."
    )
    markings: list[MarkingResult] = Field(
        [], description="Each marking that should be in view, and what was seen of it."
    )
    knocked: bool = Field(
        False,
        description="True if it was lost and found again, farther from its stored pose than a camera moves by itself.",
    )
    proposed: Proposal | None = Field(
        None, description="For a knocked camera that is not accepted: the pose that accepting the job stores."
    )
    displacement: Displacement | None = Field(
        None, description="Movement from the camera's anchor, see `GET /venues/{id}/cameras/{camera}/trend`."
    )


class SeamPlace(Schema):
    """A piece of line that two cameras see, and how far apart they put it."""

    at: list[float] = Field(description="Point of the pitch, [x, y] in metres.")
    across: list[float] = Field(
        description="Direction across the line, a unit vector [x, y]: along the line nothing is measured."
    )
    error_cm: float = Field(description="Distance across the line from the first camera's paint to the second's, cm.")
    sigma_cm: float = Field(description="One standard deviation of it, cm.")


class PairResult(Schema):
    """Agreement of two cameras along their seam."""

    cameras: list[Id] = Field(description="Ids of the two cameras.")
    stitch_error_px: float | None = Field(
        description="Stitch error at the centre of the pitch, or of the common view; null if the views do not match."
    )
    seam: list[SeamPlace] = Field(
        description="Places along the common view, on lines that both cameras measured, from end to end; at most 24."
    )
    worst: SeamPlace | None = Field(description="Place with the largest error, without badly measured ones.")


class Provenance(Schema):
    """Software, network, seed and options: all that is needed to reproduce a result from its frames."""

    software: str = Field(description="Version of ESC.")
    model_sha256: str = Field(description="SHA-256 of the network's file.")
    seed: int = Field(description="Seed of the random numbers.")
    options: dict[str, Any] = Field(description="Options with all defaults.")


class Suspicion(Schema):
    """A parameter of a camera's lens, or a dimension of the field, that the lines contradict."""

    camera: Id | None = Field(description="Id of the camera; null: the field.")
    quantity: str = Field(description="Parameter or dimension, with its unit at the end.")
    deviation: float = Field(description="How much larger than in the venue it seems to be.")
    sigma: float = Field(description="One standard deviation of `deviation`.")
    detail: str = Field(description="The same in words.")


class AdoptableNumber(Schema):
    """A dimension of the field that the lines determine and contradict.

    `POST /venues/{id}/adopt-field` stores `value`; nothing is stored automatically.
    """

    name: Annotated[FieldNumber, OPEN_WORD] = Field(description="Dimension of the field.")
    given: float = Field(description="Value in the venue that the job began with, m.")
    value: float = Field(description="Value by the lines, m.")
    sigma: float = Field(description="One standard deviation of `value`, m.")
    moves_m: dict[Id, float] = Field(
        {},
        description="Approximate movement of each accepted camera with the new value, m: the same lines fitted again. "
        "The next calibration moves the cameras; storing the value does not.",
    )


class Result(Schema):
    """Result of a calibration. Stitch errors: 1 px is 10 cm on the pitch; a single camera has none."""

    kind: Literal["calibration"] = Field("calibration", description=KIND)
    verdict: Annotated[Verdict, OPEN_WORD] = Field(description="Acceptance of the poses: of all cameras, some or none.")
    accepted: bool = Field(description="True if the poses of all cameras are accepted.")
    rejected_because: str | None = Field(description="All reasons, with the cameras that they concern.")
    cameras: list[CameraResult] = Field(description="Result for each camera of the venue.")
    ridge: list[Row] | None = Field(None, description="With fit_ridge: the ridge that was found.")
    diagnosis: list[Suspicion] = Field([], description="Parameters of the venue that the lines contradict.")
    adoptable: list[AdoptableNumber] = Field(
        [], description="Dimensions of the field in the diagnosis that can be stored, and the effect of each."
    )
    warnings: list[str] = Field(
        [], description="Assumptions that the venue leaves open, such as lenses without `sigma`; missing pictures."
    )
    stitch_error_px: float | None = Field(
        description="Distance between the positions that two cameras give the same markings: the worst pair's."
    )
    stitch_error_before_px: float | None = Field(description="Stitch error of the stored poses in the same frames.")
    stitch_error_limit_px: float | None = Field(None, description="Largest stitch error that the gate accepts.")
    pairs: list[PairResult] = Field([], description="Pairs of cameras that were compared.")
    loss: float | None = Field(description="Loss of the resulting poses, at the middle level of the search.")
    generations: int = Field(description="Generations that the search took.")
    path: Annotated[Literal["near", "wide", "anywhere"], OPEN_WORD] = Field(
        "wide",
        description="`near`: the cameras stand almost as stored, and no search was needed. `wide`: a search around the "
        "stored poses. `anywhere`: some camera was lost and found again, in another direction from its stored "
        "position or, with `search` `anywhere`, elsewhere.",
    )
    timings_s: dict[str, float] = Field(description=TIMINGS)
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance

    @property
    def recovered_cameras(self) -> list[str]:
        """Ids of the knocked cameras whose new poses may replace the stored ones."""
        return [camera.id for camera in self.cameras if camera.accepted and camera.knocked]

    @property
    def accepted_cameras(self) -> list[str]:
        """Ids of the cameras whose poses may replace the stored ones."""
        return [camera.id for camera in self.cameras if camera.accepted]

    def refuse_all(self, because: str, reason: str = "all-or-none") -> "Result":
        """Return the result with every pose refused, for a reason of `REFUSAL_REASONS` (`service.schemas.problems`).

        The reasons that it was rejected for before stay.
        """
        refusal = {"accepted": False, "rejected_because": because, "refusal": refusal_uri(reason)}
        cameras = [
            camera.model_copy(update={"accepted": False} if camera.rejected_because else refusal)
            for camera in self.cameras
        ]
        reasons = [because] if self.rejected_because is None else [self.rejected_because, because]
        summary = "; ".join(one.removesuffix(".") for one in reasons)
        return self.model_copy(
            update={"verdict": "rejected", "accepted": False, "rejected_because": summary, "cameras": cameras}
        )


class PhotoResult(Schema):
    """Use of a photo in a lens calibration."""

    name: str = Field(description="Name of the photo's file.")
    fate: Annotated[Literal["used", "no-board", "wrong-size", "hurts"], OPEN_WORD] = Field(
        description="`used`, or why it was not: no board was found, its size differs, or the lens is better without it."
    )
    rms_px: float | None = Field(description="Root mean square error of its corners, pixels.")
    left_out_px: float | None = Field(description="The same with a lens fitted to the other photos.")
    blurred: bool = Field(description="True if it is less sharp than the others.")

    @computed_field(  # type: ignore[prop-decorator]
        description="The same as `fate`, with `excluded` in place of `hurts`.",
        json_schema_extra={"x-extensible-enum": ["used", "no-board", "wrong-size", "excluded"]},
    )
    @property
    def outcome(self) -> str:
        """Use of the photo."""
        return "excluded" if self.fate == "hurts" else self.fate


class CoverageResult(Schema):
    """Coverage of the picture by the board."""

    share: float = Field(description="Share 0..1 of the picture that the board covered.")
    empty: list[str] = Field(description="Ninths of the picture without any corner.")


class LensTrial(Schema):
    """A lens that was tried."""

    terms: list[str] = Field(description="Parameters that were free.")
    rms_px: float = Field(description="Root mean square error in the photos, pixels.")
    left_out_px: float = Field(description="The same in photos that were left out of the fit.")


class IntrinsicsResult(Schema):
    """A lens from photos of a board, and its uncertainty."""

    kind: Literal["intrinsics"] = Field("intrinsics", description=KIND)
    image_size: list[int] = Field(description="Width and height of the photos, pixels.")
    intrinsics: Intrinsics
    terms: list[str] = Field(description="Parameters of the lens that were fitted.")
    rms_px: float = Field(description="Root mean square error of the corners, pixels.")
    left_out_px: float = Field(description="The same in photos that were left out of the fit.")
    sigma: dict[str, float] = Field(description="One standard deviation by parameter, if all corners were independent.")
    spread: dict[str, float] = Field(description="The same by leaving out photos, which is more realistic.")
    coverage: CoverageResult
    photos: list[PhotoResult] = Field(description="Use of each photo.")
    trials: list[LensTrial] = Field(description="Lenses that were tried.")
    warnings: list[str] = Field(description="Doubts, and what to photograph next.")
    timings_s: dict[str, float] = Field(description=TIMINGS)
    software: str = Field(description="Version of ESC.")


class PointResult(Schema):
    """Check of a clicked point."""

    world: Landmark | Coordinates = Field(description="The point, as it was sent.")
    residual_px: float | None = Field(
        description="Distance from the click to the point by the pose, pixels; null if the camera cannot see it."
    )
    doubted: bool = Field(description="True if it disagrees with the other points.")
    exchanged_with: Landmark | Coordinates | None = Field(description="Point that it seems to be swapped with.")
    looks_like: str | None = Field(description="Named point that it seems to be instead.")


class LensGain(Schema):
    """Parameters of the lens that were fitted to the points, because the given lens does not fit them."""

    given: Intrinsics
    free: list[str] = Field(description="Parameters that were fitted.")
    sigma: dict[str, float] = Field(description="One standard deviation by parameter.")
    rms_before_px: float = Field(description="Root mean square error of the points with the given lens, pixels.")
    rms_px: float = Field(description="The same with the fitted lens.")
    left_out_before_px: float = Field(
        description="Root mean square error of each point in a fit to the others, with the given lens."
    )
    left_out_px: float = Field(description="The same with the fitted lens.")
    evidence: float = Field(description="Gain in BIC; 10 is strong.")


class LocateSigma(Schema):
    """One standard deviation of a first pose."""

    rotation_deg: float = Field(description="Of the rotation, degrees.")
    position_m: float = Field(description="Of the position, m.")
    pixels: float = Field(description="Of the projected points in the picture, pixels.")


class LocateResult(Schema):
    """A first pose from clicked points."""

    kind: Literal["locate"] = Field("locate", description=KIND)
    accepted: bool = Field(description="True if a calibration can start from the pose, with these `intrinsics`.")
    rejected_because: str | None = Field(description="Reason in words if it is not accepted.")
    camera: Id = Field(description="Id of the camera.")
    image_size: list[int] = Field(description="Width and height of the camera's picture, pixels.")
    intrinsics: Intrinsics
    pose: Pose
    rms_px: float = Field(description="Root mean square error of the points, pixels.")
    sigma: LocateSigma
    points: list[PointResult] = Field(description="Check of each point.")
    lens: LensGain | None
    warnings: list[str] = Field(description="Doubts about points and lens.")
    timings_s: dict[str, float] = Field(description=TIMINGS)
    software: str = Field(description="Version of ESC.")


class MeasureResult(Schema):
    """A dimension of the pitch, in the venue and by the lines."""

    name: Annotated[Literal["length_m", "width_m", "ridge_height_m", "ridge_length_m"], OPEN_WORD] = Field(
        description="Dimension of the field."
    )
    given: float = Field(description="Value in the venue, m.")
    value: float = Field(description="Value by the lines, m.")
    sigma: float = Field(description="One standard deviation of `value`, m.")
    open: float = Field(description="One standard deviation before the fit, m.")
    known: bool = Field(description="True if the lines determine it; if not, the fitted field keeps the given value.")
    detail: str = Field(description="Why the lines do or do not determine it.")


class FieldResult(Schema):
    """A pitch with the dimensions that its lines determine, and the cameras around it."""

    kind: Literal["field"] = Field("field", description=KIND)
    accepted: bool = Field(description="True if `field` may replace the venue's; nothing is replaced automatically.")
    rejected_because: str | None = Field(description="Reason in words if it is not accepted.")
    field: FieldOfPlay
    measures: list[MeasureResult] = Field(description="Dimensions, each with its uncertainty.")
    cameras: list[CameraResult] = Field(description="Cameras, calibrated on `field`.")
    stitch_error_px: float | None = Field(description="Stitch error on `field`; 1 px is 10 cm on the pitch.")
    warnings: list[str] = Field([], description="Pictures that are missing.")
    timings_s: dict[str, float] = Field(description=TIMINGS)
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance


class CandidateResult(Schema):
    """A pose and lens that may have taken the frame."""

    intrinsics: Intrinsics
    pose: Pose
    agreement: float = Field(
        description="0..1: share of the expected lines that are seen, and of the seen lines that are expected."
    )
    lines_found: float = Field(description="Share 0..1 of the expected lines that are seen.")
    residual_px: float | None = Field(
        description="Root mean square of the measured lines, pixels; null if too few were measured."
    )
    sigma: Sigma | None


FindReason = Annotated[
    Literal["no-lines", "lines", "few-lines", "implausible", "not-unique", "not-confirmed"], OPEN_WORD
]


class FoundCameraResult(Schema):
    """Result of a search for one camera."""

    id: Id = Field(description="Id of the camera.")
    accepted: bool = Field(description="True if the first candidate is the camera.")
    reason: FindReason | None = Field(description="Reason if it is not accepted, in a word.")
    rejected_because: str | None = Field(description="Reason in words if it is not accepted.")
    remarks: list[str] = Field(
        description="Assumptions, such as the side of a symmetric field, and doubts about its lens."
    )
    assumed_side: Annotated[Literal["near", "far", "left", "right"], OPEN_WORD] | None = Field(
        None,
        description="Side of the field that the first candidate stands on, by an assumption about all cameras of the "
        "search. If it is wrong, take the second candidate of each: half a turn about the field's centre away.",
    )
    image_size: list[int] = Field(description="Width and height of its frame, pixels.")
    candidates: list[CandidateResult] = Field(description="Candidates, the best first.")


class FindResult(Schema):
    """Cameras found from their frames.

    Nothing is stored automatically: `POST /venues/{id}/adopt-found` stores the cameras.
    """

    kind: Literal["find"] = Field("find", description=KIND)
    accepted: bool = Field(description="True if all cameras were found.")
    rejected_because: str | None = Field(description="Reasons in words for cameras that are not accepted.")
    cameras: list[FoundCameraResult] = Field(description="Cameras that were searched for.")
    ridge: list[Row] | None = Field(
        None,
        description="Ridge that the lines determine for a field that was given as flat; it is stored with the poses. "
        "Null: none was found, or the field has one.",
    )
    stitch_error_px: float | None = Field(description="Stitch error of the found cameras; 1 px is 10 cm on the pitch.")
    warnings: list[str] = Field([], description="Pictures that are missing.")
    timings_s: dict[str, float] = Field(description=TIMINGS)
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance

    def chosen(self, choice: Mapping[str, int | None] = NO_CHOICE) -> dict[str, CandidateResult]:
        """Return the chosen candidates by camera.

        `choice`: number of a candidate from 1, or None for no candidate; a camera that it does not name gets its first
        candidate if that is accepted.
        """
        first = {camera.id: 1 for camera in self.cameras if camera.accepted}
        candidates = {camera.id: camera.candidates for camera in self.cameras}
        return {camera: candidates[camera][n - 1] for camera, n in {**first, **choice}.items() if n is not None}


AnyResult = Annotated[
    Result | IntrinsicsResult | LocateResult | FieldResult | FindResult | CheckResult,
    Field(discriminator="kind"),
    OpenChoice("kind", "OtherResult", "Result of a kind of job that later versions add."),
]
