"""A typed client of the HTTP interface: what `esc venue`, `esc calibrate` and `esc job` speak."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx

from service.schemas import FormatName, History, Job, Revision, Venue, VenueIn, Venues

# Longer than the longest poll.
TIMEOUT_S = 75
# How long a service may be away from somebody who follows a job: a restart, a database that comes back.
PATIENCE_S = 60.0


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


class Client:
    """One service, by its URL."""

    def __init__(self, url: str, api_key: str | None = None) -> None:
        headers = {"Authorization": f"Bearer {api_key}"} if api_key else {}
        self._http = httpx.Client(base_url=url, headers=headers, timeout=TIMEOUT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def put_venue(self, venue: VenueIn) -> Venue:
        """Create or replace a venue."""
        content = venue.model_dump(mode="json", exclude_none=True)
        return Venue.model_validate(self._json("PUT", f"/venues/{venue.id}", json=content))

    def venue(self, venue_id: str) -> Venue:
        """A venue with its stored poses."""
        return Venue.model_validate(self._json("GET", f"/venues/{venue_id}"))

    def venues(self) -> Iterator[Venue]:
        """All venues, page by page."""
        cursor = None
        while True:
            page = Venues.model_validate(self._json("GET", "/venues", params={"cursor": cursor} if cursor else {}))
            yield from page.venues
            cursor = page.next_cursor
            if cursor is None:
                return

    def delete_venue(self, venue_id: str) -> None:
        """Forget a venue."""
        self._answer("DELETE", f"/venues/{venue_id}")

    def history(self, venue_id: str) -> Iterator[Revision]:
        """Every change of a venue's poses, newest first, page by page."""
        cursor = None
        while True:
            params: dict[str, Any] = {"cursor": cursor} if cursor else {}
            page = History.model_validate(self._json("GET", f"/venues/{venue_id}/history", params=params))
            yield from page.revisions
            cursor = page.next_cursor
            if cursor is None:
                return

    def restore(self, venue_id: str, revision: int) -> Venue:
        """Let the poses of a revision hold again."""
        return Venue.model_validate(self._json("POST", f"/venues/{venue_id}/restore", json={"revision": revision}))

    def venue_poses(self, venue_id: str, form: FormatName, camera: str | None = None) -> bytes:
        """The poses that hold now, of one camera or all, as a file of another tool's format."""
        return self._document(f"/venues/{venue_id}/poses", form, camera)

    def job_poses(self, job_id: str, form: FormatName, camera: str | None = None) -> bytes:
        """The poses that a job found, of one camera or all, as a file of another tool's format."""
        return self._document(f"/jobs/{job_id}/poses", form, camera)

    def snapshot(self, venue_id: str, camera: str) -> bytes:
        """What a camera shows now, a JPEG or PNG from its source."""
        return self._answer("GET", f"/venues/{venue_id}/cameras/{camera}/snapshot").content

    def calibrate(
        self,
        venue_id: str,
        files: Mapping[str, Sequence[Path]],
        options: Mapping[str, Any],
        idempotency_key: str | None = None,
    ) -> Job:
        """Submit frames, or none: then they are fetched. The job may be an older one if the content is the same."""
        return self._submit_frames(f"/venues/{venue_id}/calibrate", files, options, idempotency_key)

    def fit_field(
        self,
        venue_id: str,
        files: Mapping[str, Sequence[Path]],
        options: Mapping[str, Any],
        idempotency_key: str | None = None,
    ) -> Job:
        """Submit frames by which to fit the measures of a venue's pitch; the venue stays as it is."""
        return self._submit_frames(f"/venues/{venue_id}/field/fit", files, options, idempotency_key)

    def _submit_frames(
        self, path: str, files: Mapping[str, Sequence[Path]], options: Mapping[str, Any], idempotency_key: str | None
    ) -> Job:
        parts: list[tuple[str, tuple[str, bytes, str]]] = [
            (camera, (path.name, path.read_bytes(), "application/octet-stream"))
            for camera, several in files.items()
            for path in several
        ]
        # Never without a part: a form of none is none.
        if options or not files:
            parts.append(("options", ("options.json", json.dumps(options).encode(), "application/json")))
        headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
        return Job.model_validate(self._json("POST", path, files=parts, headers=headers))

    def job(self, job_id: str, wait_s: float = 0) -> Job:
        """A job, at its end or after `wait_s`."""
        return Job.model_validate(self._json("GET", f"/jobs/{job_id}", params={"wait": wait_s} if wait_s else {}))

    def cancel(self, job_id: str) -> Job:
        """End a job."""
        return Job.model_validate(self._json("POST", f"/jobs/{job_id}/cancel"))

    def accept(self, job_id: str) -> Job:
        """Let the poses that a calibration found hold, whatever the gate said."""
        return Job.model_validate(self._json("POST", f"/jobs/{job_id}/accept"))

    def reject(self, job_id: str) -> Job:
        """Put back what was before the poses of a calibration."""
        return Job.model_validate(self._json("POST", f"/jobs/{job_id}/reject"))

    def follow(self, job: Job, show: Callable[[Job], None], every_s: float = 0.5) -> Job:
        """Wait for the end of a job, showing what it does meanwhile. The service may be away for a minute."""
        answered = time.monotonic()
        while job.open:
            show(job)
            try:
                job = self.job(job.id, wait_s=every_s)
                answered = time.monotonic()
            except (httpx.TransportError, Refused) as error:
                passing = isinstance(error, httpx.TransportError) or error.busy
                if not passing or time.monotonic() - answered > PATIENCE_S:
                    raise
                time.sleep(every_s)
        return job

    def picture(self, job: Job, name: str) -> bytes | None:
        """A picture by the name of its link; None where the job made no such one."""
        return self._answer("GET", job.links[name]).content if name in job.links else None

    def url_of(self, path: str) -> str:
        """The address of something the service linked to."""
        return str(self._http.base_url.join(path))

    def _document(self, path: str, form: FormatName, camera: str | None) -> bytes:
        return self._answer("GET", path, params={"format": form} | ({"camera": camera} if camera else {})).content

    def _json(self, method: str, path: str, **request: Any) -> Any:
        return self._answer(method, path, **request).json()

    def _answer(self, method: str, path: str, **request: Any) -> httpx.Response:
        response = self._http.request(method, path, **request)
        if response.is_success:
            return response
        try:
            members = response.json()
        except ValueError:
            members = {"title": f"HTTP {response.status_code}", "detail": response.text[:500]}
        raise Refused(response.status_code, members if isinstance(members, dict) else {})
