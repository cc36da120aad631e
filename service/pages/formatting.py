"""Numbers and times in words for people, and names of alarms and kinds of jobs."""

import re
from datetime import UTC, datetime

from service.schemas.health import AlarmRule
from service.schemas.names import JobKind
from service.schemas.problems import Problem

NONE = "–"
# Length on the pitch of a stitch error of 1 px.
CM_PER_STITCH_PX = 10.0
ALARMS: dict[AlarmRule, str] = {
    "moved-since-last": "Moved",
    "moved-since-first": "Drifted",
    "rejected-in-a-row": "Rejected again",
    "not-calibrated": "Overdue",
    "trend": "Drifting",
    "knocked": "Knocked",
    "live-not-measured": "Live: not measured",
    "live-late": "Live: late",
    "live-silent": "Live: silent",
}
KINDS: dict[JobKind, str] = {
    "calibration": "Calibration",
    "intrinsics": "Lens from photos",
    "locate": "First pose",
    "field": "Fit of the field",
    "find": "Search for cameras",
    "check": "Check of a calibration",
}
# Replacements for details that only speak of requests.
FOR_PEOPLE: dict[str, str] = {
    "venue-not-found": "Somebody has deleted it, or the address is mistyped.",
    "job-not-found": "Somebody has deleted it, or the address is mistyped.",
}
OF_PROGRAMS = re.compile(r"\b(GET|PUT|POST|PATCH|DELETE) /")


def for_people(problem: Problem) -> str:
    """Return the detail of a problem without sentences about HTTP requests, and without the marks of code."""
    sentences = re.split(r"(?<=[.!?])\s+", problem.detail)
    detail = " ".join(sentence for sentence in sentences if not OF_PROGRAMS.search(sentence))
    return detail.replace("`", "") or FOR_PEOPLE.get(problem.kind, "")


def figure(value: float | None, unit: str = "", digits: int = 2) -> str:
    """Return a number with its unit and at most three significant digits: 0.04 px, 13.5 px, 135 px."""
    if value is None:
        return NONE
    places = max(0, digits - (abs(value) >= 10) - (abs(value) >= 100))
    return f"{value:.{places}f}{' ' + unit if unit else ''}"


def centimetres(metres: float | None) -> str:
    """Return a length in centimetres."""
    return NONE if metres is None else figure(100 * metres, "cm")


def on_the_pitch(stitch_error_px: float | None) -> str:
    """Return a stitch error as a length on the pitch."""
    return NONE if stitch_error_px is None else figure(CM_PER_STITCH_PX * stitch_error_px, "cm", 1)


def degrees(value: float | None) -> str:
    """Return an angle in degrees."""
    return NONE if value is None else f"{value:.3f}°"


def probability(value: float | None) -> str:
    """Return a probability in percent with a decimal place, of which benchmarks can judge no more: > 99.9 %."""
    if value is None:
        return NONE
    if value > 0.999:
        return "> 99.9 %"
    return "< 0.1 %" if value < 0.001 else f"{100 * value:.1f} %"


def percent(share: float | None) -> str:
    """Return a share of 0..1 in per cent."""
    return NONE if share is None else f"{100 * share:.0f} %"


def length_change(share: float) -> str:
    """Return a relative change of the focal length in words: `0.12 % shorter`."""
    amount = f"{100 * abs(share):.2f}"
    return "unchanged" if amount == "0.00" else f"{amount} % {'longer' if share > 0 else 'shorter'}"


def capitalised(words: str) -> str:
    """Return words with a capital first letter; the rest stays."""
    return words[:1].upper() + words[1:]


def ago(moment: datetime, now: datetime | None = None) -> str:
    """Return the time since a moment: `3 min ago`; to the minute within a day, which many calibrations may have."""
    seconds = int(((now or datetime.now(UTC)) - moment).total_seconds())
    if seconds < 5:
        return "just now"
    if seconds < 60:
        return f"{seconds} s ago"
    hours, minutes = divmod(seconds // 60, 60)
    if hours >= 24:
        return f"{hours // 24} d ago"
    return f"{hours} h {minutes} min ago" if hours else f"{minutes} min ago"


def moment(when: datetime) -> str:
    """Return a date and time of day in UTC."""
    return f"{when.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def seconds(value: float | None) -> str:
    """Return a duration in seconds."""
    return NONE if value is None else figure(value, "s")
