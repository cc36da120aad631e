"""What the client makes of an answer that is not the one hoped for: whether to ask again, and when."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import httpx

NOT_INSTALLED = "/problems/extra-missing"
# Where a service asks for more time than this (Retry-After), it is asked again all the same.
LONGEST_PAUSE_S = 60.0


class Refused(Exception):  # noqa: N818
    """The service answered with a problem: `members` are its JSON object.

    `busy`: trying the same again later can help. Of conflicts, those that the service gives a time for (Retry-After);
    and what a proxy says that does not reach the service. `retry_after_s`: when, where the service says it.
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
    """The service answered with what this client cannot read, though it allows for newer versions."""

    def __init__(self, what: str) -> None:
        super().__init__(f"The answer of the service is not understood: {what}")


def refusal(response: httpx.Response) -> Refused:
    """Of an answer that was read."""
    try:
        members = response.json()
    except ValueError:
        members = {"title": f"HTTP {response.status_code}", "detail": response.text[:500]}
    retry_after = response.headers.get("retry-after")
    return Refused(response.status_code, members if isinstance(members, dict) else {}, retry_after)


def passing(error: httpx.TransportError | Refused) -> bool:
    """Whether the service may be back in a moment."""
    return isinstance(error, httpx.TransportError) or error.busy


def pause_s_of(error: httpx.TransportError | Refused, otherwise_s: float) -> float:
    """How long to wait before asking again: as long as the service says, within reason."""
    asked_s = error.retry_after_s if isinstance(error, Refused) else None
    return otherwise_s if asked_s is None else min(max(asked_s, otherwise_s), LONGEST_PAUSE_S)


def _seconds(retry_after: str | None) -> float | None:
    """What the header says; a proxy may write the time at which, which is passed over."""
    return float(retry_after) if retry_after is not None and retry_after.isascii() and retry_after.isdigit() else None
