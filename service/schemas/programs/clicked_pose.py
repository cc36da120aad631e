"""What the program that finds a first pose while somebody clicks is asked, and what it answers."""

from __future__ import annotations

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
    """A camera that has no pose yet, and what was clicked in its frame."""

    field: FieldOfPlay
    id: Id
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)]
    intrinsics: Intrinsics
    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]


class ClickedPose(Schema):
    """Its pose, or why there is none yet; the field by this pose and each point's place by it, in pixels."""

    result: LocateResult | None
    error: JobError | None
    lines: list[Polyline]
    expected: list[list[float] | None]
