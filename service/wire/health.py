"""How a service and its venues are doing: the rules of alarms, what rings, and what is told of it."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from service.wire.addresses import CallbackUrl
from service.wire.base import Id, Number, Whole, Wire
from service.wire.history import RevisionCamera
from service.wire.schedule import ScheduleState

ALARMS_EXAMPLE: dict[str, Any] = {
    "moved_since_last_px": 40,
    "rejected_in_a_row": 3,
    "not_calibrated_for_h": 24,
    "callback_url": "https://example.com/alarms",
}


class Alarms(Wire):
    """When to sound the alarm about a venue; each rule may be left out."""

    model_config = ConfigDict(json_schema_extra={"examples": [ALARMS_EXAMPLE]})

    moved_since_last_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A calibration moves the pitch in the picture of a camera by more than this."
    )
    moved_since_first_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A camera's picture is further than this from where the camera was put."
    )
    rejected_in_a_row: Annotated[Whole, Field(ge=1, le=1000)] | None = Field(
        None, description="So many calibrations one after the other fail, or bring no pose of a camera or of any."
    )
    not_calibrated_for_h: Annotated[Number, Field(gt=0, le=10000)] | None = Field(
        None, description="No pose is accepted for so many hours, of a camera or of any."
    )
    trend_m: Annotated[Number, Field(gt=0, le=100)] | None = Field(
        None,
        description="Over nights, a camera moves beyond what its own spread explains, and by at least so many metres "
        "at the far touchline, see `GET /venues/{id}/cameras/{camera}/trend`.",
    )
    callback_url: CallbackUrl | None = Field(
        None, description="Told when an alarm begins and when it is over, signed (Standard Webhooks)."
    )


AlarmRule = Literal["moved-since-last", "moved-since-first", "rejected-in-a-row", "not-calibrated", "trend"]


class Alarm(Wire):
    """An alarm that rings, of one camera or (null) of the whole venue."""

    rule: AlarmRule
    camera: Id | None
    since: datetime
    why: str


class CameraHealth(RevisionCamera):
    """Where a camera stands, and how its calibrations went."""

    accepted_at: datetime | None = Field(description="When its pose was last accepted.")
    rejected_in_a_row: int = Field(description="Calibrations since then that failed or did not bring its pose.")


class VenueHealth(Wire):
    """How a venue is doing. `state` is `alarm` while one of its alarms rings."""

    state: Literal["ok", "alarm"]
    alarms: list[Alarm]
    revision: int = Field(description="The one that holds.")
    cameras: list[CameraHealth] = Field(description="Where they stand, and how far that is from where they were put.")
    stitch_error_px: float | None = Field(description="Of the poses that hold, by the last result.")
    accepted_at: datetime | None = Field(description="When poses were last accepted, of any camera.")
    rejected_in_a_row: int = Field(description="Calibrations since then that failed or brought no pose at all.")
    schedule: ScheduleState | None = None


class VenueAlarm(Alarm):
    """An alarm with its venue."""

    venue: Id


class AlarmEvent(Wire):
    """What the `callback_url` of a venue's alarms gets, at least once: an alarm began, or is over.

    Every attempt has the same `webhook-id`.
    """

    type: Literal["alarm.began", "alarm.ended"]
    timestamp: datetime = Field(description="When it began or ended.")
    data: VenueAlarm


class Health(Wire):
    """`ok`, or per part what is wrong with it."""

    status: Literal["ok", "unavailable"]
    parts: dict[str, str] = Field({})
