"""Schedules of venues and when they fire: cron's five fields, in a time zone.

Thousands of venues have the same five fields, and cameras, network and queue would have all of them at once. So each
fires a little after its time, by its name always the same: at most a quarter of an hour, and before its next time.
"""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime, timedelta
from typing import Annotated, Self
from zoneinfo import ZoneInfo

from pydantic import ConfigDict, Field, StringConstraints, ValidationInfo, model_validator

from service.schemas.base import Flag, Integer, Number, Schema, is_tolerant
from service.schemas.options import Options

FIELDS = 5
# All of them are fetched within the ten minutes after which another worker would begin.
MOST_FRAMES = 16
LONGEST_SPACING_S = 30
SPACING_S = 5.0
LONGEST_SPREAD = timedelta(minutes=15)


class Schedule(Schema):
    """When the service calibrates a venue by itself, with frames from the sources of its cameras."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"cron": "*/15 6-23 * * *", "time_zone": "Europe/Berlin"}]}
    )

    cron: Annotated[str, StringConstraints(max_length=100)] = Field(
        description="Cron's five fields: minute, hour, day, month, day of the week."
    )
    time_zone: Annotated[str, StringConstraints(max_length=64)] = Field("UTC", description="A name of IANA's.")
    exact: Flag = Field(
        False,
        description="Fire at these times to the second. Otherwise up to 15 minutes later, never after the next time, "
        "and always by the same share of it: venues with the same schedule do not all come at once.",
    )
    # Left out where nobody asked for more: what reads venues of 0.1.0 knows neither.
    frames: Annotated[Integer, Field(ge=1, le=MOST_FRAMES)] = Field(
        1,
        exclude_if=lambda frames: frames == 1,
        description="Of each camera, fused into one picture: what moves between them, players say, is removed.",
    )
    spacing_s: Annotated[Number, Field(ge=0.1, le=LONGEST_SPACING_S)] = Field(
        SPACING_S,
        exclude_if=lambda spacing_s: spacing_s == SPACING_S,
        description="From the beginning of one frame to the next, where there are several.",
    )
    options: Options | None = Field(None, description="Of its calibrations; absent: what they are when none are given.")

    @model_validator(mode="after")
    def _fires(self, info: ValidationInfo) -> Self:
        # What another version let through was checked there.
        if is_tolerant(info):
            return self
        try:
            next_time(self.cron, self.time_zone, datetime.now(UTC))
        except ModuleNotFoundError as missing:
            # The client that is installed alone comes without it. Then the service says what is no schedule.
            if missing.name != "croniter":
                raise
        return self


class ScheduleState(Schema):
    """When a venue is calibrated next, and what came of the last time."""

    next_at: datetime
    last_at: datetime | None = Field(description="The last time; null: it has not come yet.")
    last_job: str | None = Field(description="Of the last time; one that had no frames to compute has failed.")
    last_error: str | None = Field(description="Why the last time brought no poses, or is put off.")


class InvalidSchedule(ValueError):  # noqa: N818
    """The schedule never fires; the message says why."""


def phase_of(venue_id: str) -> float:
    """Return the phase of a venue, 0 (included) to 1: the share of the delay by which it fires after a cron time."""
    return int.from_bytes(hashlib.sha256(venue_id.encode()).digest()[:4]) / 2**32


def next_time(cron: str, time_zone: str, after: datetime, phase: float = 0.0) -> datetime:
    """Return the first time after `after`, in UTC, at which a schedule fires with this `phase` (see `phase_of`).

    Raises `InvalidSchedule` for what is no schedule, or never fires. A time that a clock skips when summer begins fires
    right after, one that it shows twice in autumn fires twice.
    """
    if not phase:
        return _next_local_time(cron, time_zone, after)
    # What is a little late may be of a time that has come before.
    time = _next_local_time(cron, time_zone, after - LONGEST_SPREAD)
    while True:
        following = _next_local_time(cron, time_zone, time)
        late = timedelta(seconds=int(phase * min(following - time, LONGEST_SPREAD).total_seconds()))
        if time + late > after:
            return time + late
        time = following


def _next_local_time(cron: str, time_zone: str, after: datetime) -> datetime:
    # The commands of the client, which start anew each time, seldom look at a schedule.
    from croniter import CroniterError, croniter

    if len(cron.split()) != FIELDS:
        raise InvalidSchedule(f"{cron!r} is not cron's five fields: minute, hour, day, month, day of the week")
    try:
        zone = ZoneInfo(time_zone)
    except (KeyError, ValueError, OSError):
        raise InvalidSchedule(f"{time_zone!r} is no time zone such as Europe/Berlin") from None
    try:
        local = croniter(cron, after.astimezone(zone)).get_next(datetime)
    except CroniterError as error:
        raise InvalidSchedule(f"{cron!r} is no schedule: {error}") from None
    found: datetime = local.astimezone(UTC)
    return found
