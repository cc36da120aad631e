"""Errors of the client, and when to ask again."""

from collections.abc import Mapping
from typing import Any

import httpx

NOT_INSTALLED = "/problems/extra-missing"
# Longest pause before a service is asked again, whatever its Retry-After says.
LONGEST_PAUSE_S = 60.0


class Refused(Exception):  # noqa: N818
    """Raised when the service answers with a problem (RFC 9457), whose JSON object is `members`.

    `busy`: trying the same again later can help, as in a conflict with a Retry-After, or where a proxy does not reach
    the service. `retry_after_s`: seconds until then, where the service says it.
    """

    def __init__(self, status: int, members: Mapping[str, Any], retry_after: str | None = None) -> None:
        super().__init__(f"{members.get('title', 'Refused')}: {members.get('detail', '')}")
        self.status = status
        self.members = members
        self.retry_after_s = _seconds(retry_after)
        self.busy = (
            status == 429
            or (status == 409 and retry_after is not None)
            or (status == 503 and members.get("type") != NOT_INSTALLED)
            or (status in (502, 504) and "type" not in members)
        )


class NotUnderstood(Exception):  # noqa: N818
    """Raised when this client, which allows for newer services, cannot read an answer."""

    def __init__(self, what: str) -> None:
        super().__init__(f"The answer of the service is not understood: {what}")


def refusal(response: httpx.Response) -> Refused:
    """Return the error for an answer whose body was read."""
    try:
        members = response.json()
    except ValueError:
        members = {"title": f"HTTP {response.status_code}", "detail": response.text[:500]}
    retry_after = response.headers.get("retry-after")
    return Refused(response.status_code, members if isinstance(members, dict) else {}, retry_after)


def is_passing(error: httpx.TransportError | Refused) -> bool:
    """True if the service may be back in a moment."""
    return isinstance(error, httpx.TransportError) or error.busy


def pause_s_of(error: httpx.TransportError | Refused, otherwise_s: float) -> float:
    """Return the seconds to wait before asking again: as many as the service says, up to `LONGEST_PAUSE_S`."""
    asked_s = error.retry_after_s if isinstance(error, Refused) else None
    return otherwise_s if asked_s is None else min(max(asked_s, otherwise_s), LONGEST_PAUSE_S)


def _seconds(retry_after: str | None) -> float | None:
    """Return the seconds of a Retry-After header; None for the date that a proxy may write."""
    return float(retry_after) if retry_after is not None and retry_after.isascii() and retry_after.isdigit() else None
