"""A first pose at once, while somebody clicks points of the pitch in a frame: no job, no venue, nothing stored."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from service.api.programs import OneAtATime
from service.settings import Settings
from service.wire.schemas import ClickedPoint, FieldOfPlay, Id, Intrinsics, JobError, LocateResult, Side, Wire

Polyline = list[list[float]]
# Clicks come a second apart; a pose takes less.
_poses = OneAtATime("first pose", longest_s=60, again_s=1, patience_s=10)


class ClickedCamera(Wire):
    """A camera that has no pose yet, and what was clicked in its frame."""

    field: FieldOfPlay
    id: Id
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)]
    intrinsics: Intrinsics
    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]


class ClickedPose(Wire):
    """Its pose, or why there is none yet; the field by this pose and each point's place by it, in pixels."""

    result: LocateResult | None
    error: JobError | None
    lines: list[Polyline]
    expected: list[list[float] | None]


def clicked_pose(asked: ClickedCamera, settings: Settings) -> ClickedPose:
    """Ask the program that computes it."""
    answer = _poses.run(settings.pose_program, settings.native_environment, asked.model_dump_json().encode())
    return ClickedPose.model_validate_json(answer)
