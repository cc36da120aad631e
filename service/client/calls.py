"""What a client says to the service and what it makes of the answers, without a word about how they travel.

Each function is a conversation: a generator that yields a `Request` for every request and is sent its answer, yields a
`Pause` to wait, and returns what it was about. What goes wrong on the way is raised inside it. `service.client` has the
two ways to hold such a conversation, blocking and not.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import httpx

from service.wire.base import OPTIONS_PART, FormatName
from service.wire.health import VenueHealth
from service.wire.history import History, Revision
from service.wire.job import Job
from service.wire.venue import Venue, VenueIn, Venues

# How long a service may be away from somebody who follows a job: a restart, a database that comes back.
PATIENCE_S = 60.0
T = TypeVar("T")


class Refused(Exception):  # noqa: N818
    """The service answered with a problem; `members` are its JSON object."""

    def __init__(self, status: int, members: Mapping[str, Any]) -> None:
        super().__init__(f"{members.get('title', 'Refused')}: {members.get('detail', '')}")
        self.status = status
        self.members = members

    @property
    def busy(self) -> bool:
        """Whether trying again later can help."""
        return self.status in (409, 429, 503)


@dataclass(frozen=True)
class Request:
    """A request, in the words of httpx."""

    method: str
    path: str
    more: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pause:
    """Nothing for so many seconds."""

    seconds: float


Conversation = Generator[Request | Pause, Any, T]


def answered(response: httpx.Response) -> httpx.Response:
    """The answer, if it is what was asked for; raises `Refused`."""
    if response.is_success:
        return response
    try:
        members = response.json()
    except ValueError:
        members = {"title": f"HTTP {response.status_code}", "detail": response.text[:500]}
    raise Refused(response.status_code, members if isinstance(members, dict) else {})


# Venues


def put_venue(venue: VenueIn) -> Conversation[Venue]:
    """Create or replace a venue."""
    content = venue.model_dump(mode="json", exclude_none=True)
    return Venue.model_validate((yield from _json("PUT", f"/venues/{venue.id}", json=content)))


def venue(venue_id: str) -> Conversation[Venue]:
    """A venue with its stored poses."""
    return Venue.model_validate((yield from _json("GET", f"/venues/{venue_id}")))


def venues() -> Conversation[list[Venue]]:
    """All venues."""
    found: list[Venue] = []
    cursor: dict[str, str] = {}
    while True:
        page = Venues.model_validate((yield from _json("GET", "/venues", params=cursor)))
        found += page.venues
        if page.next_cursor is None:
            return found
        cursor = {"cursor": page.next_cursor}


def delete_venue(venue_id: str) -> Conversation[None]:
    """Forget a venue."""
    yield from _ask("DELETE", f"/venues/{venue_id}")


def venue_health(venue_id: str) -> Conversation[VenueHealth]:
    """How a venue is doing: its alarms, the drift of its cameras, its schedule."""
    return VenueHealth.model_validate((yield from _json("GET", f"/venues/{venue_id}/health")))


def history(venue_id: str, most: int | None = None) -> Conversation[list[Revision]]:
    """Every change of a venue's poses, newest first; `most`: so many of them."""
    found: list[Revision] = []
    cursor: dict[str, int] = {}
    while True:
        page = History.model_validate((yield from _json("GET", f"/venues/{venue_id}/history", params=cursor)))
        found += page.revisions
        if page.next_cursor is None or (most is not None and len(found) >= most):
            return found[:most]
        cursor = {"cursor": page.next_cursor}


def restore(venue_id: str, revision: int) -> Conversation[Venue]:
    """Let the poses of a revision hold again."""
    asked = {"revision": revision}
    return Venue.model_validate((yield from _json("POST", f"/venues/{venue_id}/restore", json=asked)))


def venue_poses(venue_id: str, form: FormatName, camera: str | None = None) -> Conversation[bytes]:
    """The poses that hold now, of one camera or all, as a file of another tool's format."""
    return (yield from _document(f"/venues/{venue_id}/poses", form, camera))


def snapshot(venue_id: str, camera: str) -> Conversation[bytes]:
    """What a camera shows now, a JPEG or PNG from its source."""
    answer = yield from _ask("GET", f"/venues/{venue_id}/cameras/{camera}/snapshot")
    return answer.content


# Jobs


def calibrate(
    venue_id: str,
    files: Mapping[str, Sequence[Path]],
    options: Mapping[str, Any],
    idempotency_key: str | None = None,
) -> Conversation[Job]:
    """Submit frames, or none: then they are fetched. The job may be an older one if the content is the same."""
    return (yield from _submit_frames(f"/venues/{venue_id}/calibrate", files, options, idempotency_key))


def fit_field(
    venue_id: str,
    files: Mapping[str, Sequence[Path]],
    options: Mapping[str, Any],
    idempotency_key: str | None = None,
) -> Conversation[Job]:
    """Submit frames by which to fit the measures of a venue's pitch; the venue stays as it is."""
    return (yield from _submit_frames(f"/venues/{venue_id}/field/fit", files, options, idempotency_key))


def job(job_id: str, wait_s: float = 0) -> Conversation[Job]:
    """A job, at its end or after `wait_s`."""
    params = {"wait": wait_s} if wait_s else {}
    return Job.model_validate((yield from _json("GET", f"/jobs/{job_id}", params=params)))


def cancel(job_id: str) -> Conversation[Job]:
    """End a job."""
    return Job.model_validate((yield from _json("POST", f"/jobs/{job_id}/cancel")))


def accept(job_id: str) -> Conversation[Job]:
    """Let the poses that a calibration found hold, whatever the gate said."""
    return Job.model_validate((yield from _json("POST", f"/jobs/{job_id}/accept")))


def reject(job_id: str) -> Conversation[Job]:
    """Put back what was before the poses of a calibration."""
    return Job.model_validate((yield from _json("POST", f"/jobs/{job_id}/reject")))


def job_poses(job_id: str, form: FormatName, camera: str | None = None) -> Conversation[bytes]:
    """The poses that a job found, of one camera or all, as a file of another tool's format."""
    return (yield from _document(f"/jobs/{job_id}/poses", form, camera))


def picture(of: Job, name: str) -> Conversation[bytes | None]:
    """A picture by the name of its link; None where the job made no such one."""
    if name not in of.links:
        return None
    answer = yield from _ask("GET", of.links[name])
    return answer.content


def follow(followed: Job, show: Callable[[Job], None], every_s: float = 0.5) -> Conversation[Job]:
    """Wait for the end of a job, showing what it does meanwhile. The service may be away for a minute."""
    heard = time.monotonic()
    while followed.open:
        show(followed)
        try:
            followed = yield from job(followed.id, wait_s=every_s)
            heard = time.monotonic()
        except (httpx.TransportError, Refused) as error:
            passing = isinstance(error, httpx.TransportError) or error.busy
            if not passing or time.monotonic() - heard > PATIENCE_S:
                raise
            yield Pause(every_s)
    return followed


# Parts


def _submit_frames(
    path: str, files: Mapping[str, Sequence[Path]], options: Mapping[str, Any], idempotency_key: str | None
) -> Conversation[Job]:
    parts: list[tuple[str, tuple[str, bytes, str]]] = [
        (camera, (path.name, path.read_bytes(), "application/octet-stream"))
        for camera, several in files.items()
        for path in several
    ]
    # Never without a part: a form of none is none.
    if options or not parts:
        parts.append((OPTIONS_PART, ("options.json", json.dumps(options).encode(), "application/json")))
    headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
    return Job.model_validate((yield from _json("POST", path, files=parts, headers=headers)))


def _document(path: str, form: FormatName, camera: str | None) -> Conversation[bytes]:
    answer = yield from _ask("GET", path, params={"format": form} | ({"camera": camera} if camera else {}))
    return answer.content


def _json(method: str, path: str, **more: Any) -> Conversation[Any]:
    answer = yield from _ask(method, path, **more)
    return answer.json()


def _ask(method: str, path: str, **more: Any) -> Conversation[httpx.Response]:
    answer: httpx.Response = yield Request(method, path, more)
    return answer
