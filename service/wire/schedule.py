"""When a schedule fires: cron's five fields, in a time zone."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

from croniter import CroniterError, croniter

FIELDS = 5


class NoSchedule(ValueError):  # noqa: N818
    """Nothing fires by it; the message says why."""


def next_time(cron: str, time_zone: str, after: datetime) -> datetime:
    """The first time after a moment, in UTC. Raises `NoSchedule` for what is no schedule, or never fires.

    A time that a clock skips when summer begins fires right after, one that it shows twice in autumn fires twice.
    """
    if len(cron.split()) != FIELDS:
        raise NoSchedule(f"{cron!r} is not cron's five fields: minute, hour, day, month, day of the week")
    try:
        zone = ZoneInfo(time_zone)
    except (KeyError, ValueError, OSError):
        raise NoSchedule(f"{time_zone!r} is no time zone such as Europe/Berlin") from None
    try:
        local = croniter(cron, after.astimezone(zone)).get_next(datetime)
    except CroniterError as error:
        raise NoSchedule(f"{cron!r} is no schedule: {error}") from None
    found: datetime = local.astimezone(UTC)
    return found
