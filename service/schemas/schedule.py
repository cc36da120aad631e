"""Schedules of venues and the times at which they fire: cron's five fields, in a time zone.

Thousands of venues may have the same cron expression. So that they do not all load cameras, network and queue at once,
each fires with a fixed delay of its own: at most 15 minutes, and never after its next time.
"""

import hashlib
from datetime import UTC, datetime, timedelta
from typing import Annotated, Self
from zoneinfo import ZoneInfo

from pydantic import Field, StringConstraints, ValidationInfo, model_validator

from service.schemas.base import Flag, Integer, Number, Schema, is_tolerant, with_example
from service.schemas.options import Options

FIELDS = 5
# All frames must be fetched within ten minutes, after which another worker would begin.
MOST_FRAMES = 16
LONGEST_SPACING_S = 30
SPACING_S = 5.0
LONGEST_SPREAD = timedelta(minutes=15)


class Schedule(Schema):
    """Schedule of automatic calibrations, with frames from the sources of the venue's cameras."""

    model_config = with_example(cron="*/15 6-23 * * *", time_zone="Europe/Berlin")

    cron: Annotated[str, StringConstraints(max_length=100)] = Field(
        description="Cron's five fields: minute, hour, day, month, day of the week."
    )
    time_zone: Annotated[str, StringConstraints(max_length=64)] = Field("UTC", description="IANA time zone.")
    exact: Flag = Field(
        False,
        description="Fire exactly at these times. Otherwise up to 15 minutes later, always with the same delay for a "
        "venue, so that venues with the same schedule do not fire together.",
    )
    # Left out at their defaults: version 0.1.0 knows neither field.
    frames: Annotated[Integer, Field(ge=1, le=MOST_FRAMES)] = Field(
        1,
        exclude_if=lambda frames: frames == 1,
        description="Frames of each camera, fused into one picture: whatever moves, such as players, is removed.",
    )
    spacing_s: Annotated[Number, Field(ge=0.1, le=LONGEST_SPACING_S)] = Field(
        SPACING_S, exclude_if=lambda spacing_s: spacing_s == SPACING_S, description="Time from one frame to the next."
    )
    options: Options | None = Field(None, description="Options of the calibrations; absent: the defaults.")

    @model_validator(mode="after")
    def _fires(self, info: ValidationInfo) -> Self:
        # Another version has checked it.
        if is_tolerant(info):
            return self
        try:
            next_time(self.cron, self.time_zone, datetime.now(UTC))
        except ModuleNotFoundError as missing:
            # The client alone is installed without croniter; then the service checks the schedule.
            if missing.name != "croniter":
                raise
        return self


class ScheduleState(Schema):
    """Next and last run of a venue's schedule."""

    next_at: datetime = Field(description="Time of the next run.")
    last_at: datetime | None = Field(description="Time of the last run; null: none yet.")
    last_job: str | None = Field(description="Job of the last run; it has failed if there were no frames.")
    last_error: str | None = Field(description="Reason why the last run brought no poses, or is postponed.")


class InvalidSchedule(ValueError):  # noqa: N818
    """Raised for a schedule that is invalid or never fires; the message says why."""


def phase_of(venue_id: str) -> float:
    """Return the phase of a venue, 0 (included) to 1: its share of the largest delay after a cron time."""
    return int.from_bytes(hashlib.sha256(venue_id.encode()).digest()[:4]) / 2**32


def next_time(cron: str, time_zone: str, after: datetime, phase: float = 0.0) -> datetime:
    """Return the first time after `after`, in UTC, at which a schedule fires with this `phase` (see `phase_of`).

    Raises `InvalidSchedule` for what is no schedule, or never fires. A time that a clock skips when summer begins fires
    right after, one that it shows twice in autumn fires twice.
    """
    if not phase:
        return _next_local_time(cron, time_zone, after)
    # The delayed run of an earlier cron time may still be to come.
    time = _next_local_time(cron, time_zone, after - LONGEST_SPREAD)
    while True:
        following = _next_local_time(cron, time_zone, time)
        late = timedelta(seconds=int(phase * min(following - time, LONGEST_SPREAD).total_seconds()))
        if time + late > after:
            return time + late
        time = following


def _next_local_time(cron: str, time_zone: str, after: datetime) -> datetime:
    # Imported late: commands of the client must start quickly and seldom need it.
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
