"""Cameras without poses: what may be known of them, and what is found."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.schemas.addresses import SourceUrl
from service.schemas.base import OPEN_WORD, Id, Number, Schema
from service.schemas.geometry import Intrinsics, Pose, PoseIn, Position, Side, require_camera_id
from service.schemas.results import CPU_S, Provenance, Sigma
from service.schemas.venue import Ignore, NamedField, require_distinct_ids

FieldSide = Annotated[
    Literal["near", "far", "left", "right"],
    OPEN_WORD,
    Field(description="Of the field that a camera stands on: near is y < 0, far y > 0, left x < 0, right x > 0."),
]


class SoughtCameraIn(Schema):
    """A camera whose pose is sought; whatever is known of it makes that quicker and surer."""

    id: Id
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Width, height in pixels. Absent: that of its frame."
    )
    intrinsics: Intrinsics | None = Field(
        None,
        description="Its lens. With a `sigma` of `fx` above 2 % of it, the focal length is searched for. Absent: lens "
        "and pose are found together.",
    )
    field_of_view_deg: Annotated[Number, Field(ge=5, le=150)] | None = Field(
        None, description="Horizontal, roughly, where the lens is not known: focal lengths up to 30 % off are tried."
    )
    pose: PoseIn | None = Field(None, description="Of a camera that need not be found.")
    position: Position | None = Field(None, description="Roughly where it stands, m: within `position_radius_m`.")
    position_radius_m: Annotated[Number, Field(gt=0, le=1000)] = 10.0
    side: FieldSide | None = None
    ignore: Ignore = Field([])
    source: SourceUrl | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        require_camera_id(self.id)
        if self.intrinsics is not None and self.field_of_view_deg is not None:
            raise ValueError(f"camera {self.id} has intrinsics and field_of_view_deg: leave one of them out")
        if self.pose is not None and (self.intrinsics is None or self.image_size is None):
            raise ValueError(f"camera {self.id} has a pose, so it needs its intrinsics and image_size, too")
        if self.intrinsics is not None and self.image_size is None:
            raise ValueError(f"camera {self.id} has intrinsics, which belong to an image_size: give that, too")
        return self


class SoughtSite(NamedField):
    """The file of a venue whose cameras may lack poses, and lenses."""

    cameras: Annotated[list[SoughtCameraIn], Field(min_length=1, max_length=32)]

    @model_validator(mode="after")
    def _cameras_differ(self) -> Self:
        require_distinct_ids([camera.id for camera in self.cameras])
        return self


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
    """What was found for a camera: `candidates`, the best first; where it is accepted, its first one is the camera."""

    id: Id
    accepted: bool
    reason: FindReason | None = Field(description="Why it is not accepted, in a word.")
    rejected_because: str | None
    remarks: list[str] = Field(description="What was assumed, such as the side of a field that looks the same twice.")
    image_size: list[int]
    candidates: list[CandidateResult]


class FindResult(Schema):
    """Cameras found from their frames alone. `accepted`: all of them were."""

    accepted: bool
    rejected_because: str | None
    cameras: list[FoundCameraResult]
    stitch_error_px: float | None
    timings_s: dict[str, float]
    cpu_s: dict[str, float] = CPU_S
    provenance: Provenance
