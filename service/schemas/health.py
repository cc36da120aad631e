"""How a service and its venues are doing: the rules of alarms, what rings, and what is told of it."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from service.schemas.actor import Attributed
from service.schemas.addresses import CallbackUrl
from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Number, Schema
from service.schemas.history import RevisionCamera
from service.schemas.names import JobStatus, Verdict
from service.schemas.schedule import ScheduleState

ALARMS_EXAMPLE: dict[str, Any] = {
    "moved_since_last_px": 40,
    "rejected_in_a_row": 3,
    "not_calibrated_for_h": 24,
    "callback_url": "https://example.com/alarms",
}


class Alarms(Schema):
    """When to sound the alarm about a venue; each rule may be left out."""

    model_config = ConfigDict(json_schema_extra={"examples": [ALARMS_EXAMPLE]})

    moved_since_last_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A calibration moves the pitch in the picture of a camera by more than this."
    )
    moved_since_first_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A camera's picture is further than this from where the camera was put."
    )
    rejected_in_a_row: Annotated[Integer, Field(ge=1, le=1000)] | None = Field(
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
    knocked: Flag = Field(
        False, description="A calibration finds a camera elsewhere, and nobody has accepted its pose there yet."
    )
    live: Flag = Field(
        False,
        description="Of live poses: a tracked camera is not measured for 10 s, its poses are sent more than 1 s after "
        "their pictures for a minute, or the process that sends them has not reported for 30 s.",
    )
    callback_url: CallbackUrl | None = Field(
        None, description="Told when an alarm begins and when it is over, signed (Standard Webhooks)."
    )


AlarmRule = Literal[
    "moved-since-last",
    "moved-since-first",
    "rejected-in-a-row",
    "not-calibrated",
    "trend",
    "knocked",
    "live-not-measured",
    "live-late",
    "live-silent",
]
AlarmSetting = Literal[
    "moved_since_last_px",
    "moved_since_first_px",
    "rejected_in_a_row",
    "not_calibrated_for_h",
    "trend_m",
    "knocked",
    "live",
]
SETTINGS: dict[AlarmRule, AlarmSetting] = {
    "moved-since-last": "moved_since_last_px",
    "moved-since-first": "moved_since_first_px",
    "rejected-in-a-row": "rejected_in_a_row",
    "not-calibrated": "not_calibrated_for_h",
    "trend": "trend_m",
    "knocked": "knocked",
    "live-not-measured": "live",
    "live-late": "live",
    "live-silent": "live",
}


class Alarm(Schema):
    """An alarm that rings, of one camera or (null) of the whole venue."""

    rule: Annotated[AlarmRule, OPEN_WORD]
    setting: Annotated[AlarmSetting, OPEN_WORD] | None = Field(
        default_factory=lambda alarm: SETTINGS.get(alarm["rule"]),
        description="The rule's name in the venue's `alarms`; null of a rule that only a newer version knows.",
    )
    camera: Id | None
    since: datetime
    why: str


class CalibrationEnd(Schema):
    """The last calibration of a venue that ended; what needs a result is None without one."""

    status: Annotated[JobStatus, OPEN_WORD]
    finished_at: datetime
    dry_run: bool
    verdict: Annotated[Verdict, OPEN_WORD] | None = None
    stitch_error_px: float | None = None
    moved_px: float | None = None


class CameraHealth(RevisionCamera):
    """Where a camera stands, and how its calibrations went."""

    accepted_at: datetime | None = Field(description="When its pose was last accepted.")
    rejected_in_a_row: int = Field(description="Calibrations since then that failed or did not bring its pose.")


class VenueHealth(Schema):
    """How a venue is doing. `state` is `alarm` while one of its alarms rings."""

    state: Annotated[Literal["ok", "alarm"], OPEN_WORD]
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


class AlarmEvent(Attributed):
    """What the `callback_url` of a venue's alarms gets, at least once: an alarm began, or is over.

    Every attempt has the same `webhook-id`.
    """

    type: Literal["alarm.began", "alarm.ended"]
    timestamp: datetime = Field(description="When it began or ended.")
    data: VenueAlarm


class Health(Schema):
    """Whether the process can answer, and what each part of the service says."""

    status: Annotated[Literal["ok", "unavailable"], OPEN_WORD]
    parts: dict[str, str] = Field({}, description="Each part, `ok` or what is wrong with it.")
    warnings: dict[str, str] = Field(
        {}, description="The parts that are missing while this process answers all the same: jobs wait or fail."
    )
