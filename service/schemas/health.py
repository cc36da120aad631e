"""Models of the health of a service and its venues, of alarm rules and active alarms."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from service.schemas.actor import Attributed
from service.schemas.addresses import CallbackUrl
from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Number, Schema, with_example
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
    """Alarm rules of a venue; each is optional."""

    model_config = with_example(**ALARMS_EXAMPLE)

    moved_since_last_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A calibration moves the pitch in a camera's picture by more than this."
    )
    moved_since_first_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="The pitch in a camera's picture is further than this from where its first pose put it."
    )
    rejected_in_a_row: Annotated[Integer, Field(ge=1, le=1000)] | None = Field(
        None, description="This many calibrations in a row fail, or bring no accepted pose (of one camera, or at all)."
    )
    not_calibrated_for_h: Annotated[Number, Field(gt=0, le=10000)] | None = Field(
        None, description="No pose (of one camera, or at all) is accepted for this many hours."
    )
    trend_m: Annotated[Number, Field(gt=0, le=100)] | None = Field(
        None,
        description="Over nights, a camera drifts beyond its usual spread, and by at least this many metres at the far "
        "touchline, see `GET /venues/{id}/cameras/{camera}/trend`.",
    )
    knocked: Flag = Field(
        False, description="A calibration finds a knocked camera elsewhere, and nobody has accepted its new pose yet."
    )
    live: Flag = Field(
        False,
        description="Live poses have trouble: a tracked camera is not measured for 10 s, its poses are sent more than "
        "1 s after their pictures for a minute, or the process that sends them has not reported for 30 s.",
    )
    callback_url: CallbackUrl | None = Field(
        None, description="Gets a signed POST (Standard Webhooks) when an alarm begins and when it ends."
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
    """An active alarm of one camera, or of the whole venue."""

    rule: Annotated[AlarmRule, OPEN_WORD] = Field(description="Rule that is broken.")
    setting: Annotated[AlarmSetting, OPEN_WORD] | None = Field(
        default_factory=lambda alarm: SETTINGS.get(alarm["rule"]),
        description="Name of the rule in the venue's `alarms`; null for a rule that only a newer version knows.",
    )
    camera: Id | None = Field(description="Id of the camera; null: the whole venue.")
    since: datetime = Field(description="Time at which it began.")
    why: str = Field(description="Reason in words.")


class CalibrationEnd(Schema):
    """The last calibration of a venue that ended; without a result, the fields that need one are null."""

    status: Annotated[JobStatus, OPEN_WORD] = Field(description="Status that it ended in.")
    finished_at: datetime = Field(description="Time of its end.")
    dry_run: bool = Field(description="True if it was not to change the stored poses.")
    verdict: Annotated[Verdict, OPEN_WORD] | None = Field(None, description="Verdict on its poses.")
    stitch_error_px: float | None = Field(None, description="Stitch error of its poses; 1 px is 10 cm on the pitch.")
    moved_px: float | None = Field(None, description="Largest movement of the pitch in a camera's picture, pixels.")


class CameraHealth(RevisionCamera):
    """Current pose of a camera and its movements, and how its recent calibrations ended."""

    accepted_at: datetime | None = Field(description="Time at which its pose was last accepted.")
    rejected_in_a_row: int = Field(description="Calibrations since then without an accepted pose of this camera.")


class VenueHealth(Schema):
    """Health of a venue."""

    state: Annotated[Literal["ok", "alarm"], OPEN_WORD] = Field(description="`alarm` while one of `alarms` is active.")
    alarms: list[Alarm] = Field(description="Active alarms.")
    revision: int = Field(description="Number of the current revision of the poses.")
    cameras: list[CameraHealth] = Field(description="Current poses of the cameras and their movements.")
    stitch_error_px: float | None = Field(description="Stitch error of the current poses, by the last result.")
    accepted_at: datetime | None = Field(description="Time at which a pose of any camera was last accepted.")
    rejected_in_a_row: int = Field(description="Calibrations since then without any accepted pose.")
    schedule: ScheduleState | None = None


class VenueAlarm(Alarm):
    """An alarm and the id of its venue."""

    venue: Id = Field(description="Id of the venue.")


class AlarmEvent(Attributed):
    """Event of an alarm that began or ended, sent to the `callback_url` of a venue's alarms at least once.

    Every attempt has the same `webhook-id`.
    """

    type: Literal["alarm.began", "alarm.ended"] = Field(description="`alarm.began` or `alarm.ended`.")
    timestamp: datetime = Field(description="Time at which the alarm began or ended.")
    data: VenueAlarm


class Health(Schema):
    """Readiness of an API process, and the state of each part of the service."""

    status: Annotated[Literal["ok", "unavailable"], OPEN_WORD] = Field(description="`ok` if this process can answer.")
    parts: dict[str, str] = Field({}, description="State of each part: `ok`, or what is wrong with it.")
    warnings: dict[str, str] = Field(
        {}, description="Parts that are missing although this process can answer: meanwhile jobs wait or fail."
    )
