"""Request and answer of the program that finds a first pose while somebody clicks points."""

from typing import Annotated

from pydantic import Field

from service.schemas.base import Id, Schema
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Side
from service.schemas.job import JobError
from service.schemas.options import ClickedPoint
from service.schemas.results import LocateResult

Polyline = list[list[float]]


class ClickedPoseRequest(Schema):
    """A camera without a pose, and the points that were clicked in its frame."""

    field: FieldOfPlay
    id: Id
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)]
    intrinsics: Intrinsics
    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]


class ClickedPose(Schema):
    """Pose of the camera, or the reason why there is none yet.

    `lines`: polylines of the field projected by the pose, px; `expected`: the projection of each clicked point, px.
    """

    result: LocateResult | None
    error: JobError | None
    lines: list[Polyline]
    expected: list[list[float] | None]
