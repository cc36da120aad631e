"""A typed client of the HTTP interface, blocking (`Client`) and not (`AsyncClient`).

    with Client("http://127.0.0.1:8000", api_key) as client:
        job = client.follow(client.calibrate("demo", {"left": [path]}, {}), print)

    async with AsyncClient("http://127.0.0.1:8000", api_key) as client:
        venue = await client.venue("demo")

    with Client("http://127.0.0.1:8000", api_key) as client:
        for seen, event in client.venue_events("demo", ["poses.changed"]):
            print(event.type, event.data)

Both have the same methods. A service that refuses raises `Refused`. Fields and events of a newer service that this
client does not know are left out, and words that it does not know are handed on as they are.
"""

import asyncio
import json
import math
import time
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import aclosing
from datetime import date
from functools import cache
from http import HTTPStatus
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, TypeVar

import httpx
from pydantic import BaseModel, TypeAdapter, ValidationError

from service.blocking_client import blocking, blocking_stream
from service.client_errors import NotUnderstood as NotUnderstood
from service.client_errors import Refused as Refused
from service.client_errors import is_passing, pause_s_of, refusal
from service.schemas.base import TOLERANTLY
from service.schemas.events.venue_event import EVENT_TYPES, FINAL_EVENT, Event
from service.schemas.find import SoughtSite
from service.schemas.geometry import PictureMotion
from service.schemas.health import VenueHealth
from service.schemas.history import History, Revision
from service.schemas.job import Job, Jobs
from service.schemas.keys import ApiKey, ApiKeys, KeyIn, MadeKey
from service.schemas.live import LiveHistory, LiveReport, LiveState
from service.schemas.merge_patch import MEDIA_TYPE as MERGE_PATCH
from service.schemas.names import (
    CALIBRATION_PART,
    OPTIONS_PART,
    SITE_PART,
    EventKind,
    FieldNumber,
    FormatName,
    JobKind,
    JobStatus,
    LensChoice,
    StitchFormat,
)
from service.schemas.plan import LineStateName, PlanAnswer, PlannedSite
from service.schemas.trend import Trend
from service.schemas.venue import ChangedVenue, RestoredVenue, Venue, VenueIn, Venues

# Longer than the longest poll.
TIMEOUT_S = 75
# A service may be away for so long while a job is followed: a restart, a database that comes back.
PATIENCE_S = 60.0
# A stream of events says ": ping" every 15 s: one that is silent for longer leads nowhere any more.
SILENCE_S = 45.0
# Until a stream that has ended, or could not begin, is asked for again.
AGAIN_S = 2.0
# A view of 8192 pixels and many cameras takes minutes.
PACKAGE_S = 180.0
# A dozen cameras on a busy machine.
PLAN_S = 150.0
# A report is out of date by then.
REPORT_S = 5.0
NOTHING: Mapping[str, Any] = MappingProxyType({})
OCTETS = "application/octet-stream"
Answer = TypeVar("Answer", bound=BaseModel)
# A frame of each camera, or several.
Frames = Mapping[str, Path | Sequence[Path]]


class AsyncClient:
    """Client of the service at a URL, whose calls are awaited."""

    def __init__(self, url: str, api_key: str | None = None) -> None:
        self._http = httpx.AsyncClient(**_connection(url, api_key))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._http.aclose()

    def url_of(self, path: str) -> str:
        """Return the address of a path that the service linked to."""
        return str(self._http.build_request("GET", path).url)

    # Venues

    async def put_venue(self, venue: VenueIn, if_match: str | None = None) -> ChangedVenue:
        """Create or replace a venue, and say what it leaves to be assumed; `if_match`: only the one with this tag."""
        # A service need not know a field that has its default.
        content = venue.model_dump(mode="json", exclude_defaults=True)
        headers = {"If-Match": if_match} if if_match else {}
        return await self._call(ChangedVenue, "PUT", f"/venues/{venue.id}", json=content, headers=headers)

    async def patch_venue(self, venue_id: str, patch: Mapping[str, Any], if_match: str | None = None) -> ChangedVenue:
        """Change parts of a venue by a JSON merge patch; cameras may be an object of their ids."""
        headers = {"Content-Type": MERGE_PATCH} | ({"If-Match": if_match} if if_match else {})
        content = json.dumps(patch).encode()
        return await self._call(ChangedVenue, "PATCH", f"/venues/{venue_id}", content=content, headers=headers)

    async def tagged_venue(self, venue_id: str) -> tuple[Venue, str]:
        """Return a venue and its tag, for `if_match`."""
        response = await self._answer("GET", f"/venues/{venue_id}")
        return _read(Venue, response.content), response.headers["etag"]

    async def venue(self, venue_id: str) -> Venue:
        """Return a venue with its stored poses."""
        return await self._call(Venue, "GET", f"/venues/{venue_id}")

    async def venues(self) -> list[Venue]:
        """Return all venues that the service can read, see `venue_list`."""
        return (await self.venue_list()).venues

    async def venue_list(self) -> Venues:
        """Return all venues on one page, those that are stored and cannot be read as well."""
        page = await self._call(Venues, "GET", "/venues")
        found, unreadable = page.venues, page.unreadable
        while page.next_cursor is not None:
            page = await self._call(Venues, "GET", "/venues", params={"cursor": page.next_cursor})
            found += page.venues
            unreadable += page.unreadable
        return Venues(venues=found, unreadable=unreadable)

    async def delete_venue(self, venue_id: str) -> None:
        """Forget a venue."""
        await self._ask("DELETE", f"/venues/{venue_id}")

    async def venue_health(self, venue_id: str) -> VenueHealth:
        """Return the alarms of a venue, the drift of its cameras and its schedule."""
        return await self._call(VenueHealth, "GET", f"/venues/{venue_id}/health")

    async def picture_motion(self, venue_id: str, camera: str, since: int) -> PictureMotion:
        """Return how the picture of a camera has moved since a revision."""
        address = f"/venues/{venue_id}/cameras/{camera}/picture-motion"
        return await self._call(PictureMotion, "GET", address, params={"since": since})

    async def history(self, venue_id: str, most: int | None = None) -> list[Revision]:
        """Return the changes of a venue's poses, newest first; `most`: so many of them."""
        address = f"/venues/{venue_id}/history"
        page = await self._call(History, "GET", address)
        found = page.revisions
        while page.next_cursor is not None and (most is None or len(found) < most):
            page = await self._call(History, "GET", address, params={"cursor": page.next_cursor})
            found += page.revisions
        return found[:most]

    async def trend(self, venue_id: str, camera: str, since: date | None = None) -> Trend:
        """Return how a camera has moved since its anchor, night by night; `since`: the first night."""
        params = {"since": since.isoformat()} if since else {}
        return await self._call(Trend, "GET", f"/venues/{venue_id}/cameras/{camera}/trend", params=params)

    async def restore(self, venue_id: str, revision: int) -> RestoredVenue:
        """Put the poses of a revision to use again, and say what was lost by it."""
        return await self._call(RestoredVenue, "POST", f"/venues/{venue_id}/restore", json={"revision": revision})

    async def adopt_refined(self, venue_id: str, camera: str) -> Venue:
        """Store the refined pose and lens of a camera that the last accepted calibration found."""
        return await self._call(Venue, "POST", f"/venues/{venue_id}/cameras/{camera}/adopt-refined")

    async def adopt_field(self, venue_id: str, job_id: str, name: FieldNumber) -> Venue:
        """Store a number of the field as the lines of a calibration have it, of those in `adoptable` of its result."""
        document = {"job": job_id, "name": name}
        return await self._call(Venue, "POST", f"/venues/{venue_id}/adopt-field", json=document)

    async def adopt_found(self, venue_id: str, job_id: str, candidates: Mapping[str, int | None] = NOTHING) -> Venue:
        """Store the cameras that a job has found, as a new venue or as a revision.

        `candidates`: the number of the one that a camera is taken to be, from 1, None: none of them; of other cameras
        the first one that was accepted.
        """
        document = {"job": job_id, "candidates": dict(candidates)}
        return await self._call(Venue, "POST", f"/venues/{venue_id}/adopt-found", json=document)

    async def venue_poses(
        self, venue_id: str, form: FormatName, camera: str | None = None, lens: LensChoice = "stored"
    ) -> bytes:
        """Return the poses in use, of one camera or all, as a file of another tool's format."""
        return await self._ask("GET", f"/venues/{venue_id}/poses", params=_export_params(form, camera, lens))

    async def venue_stitch(
        self, venue_id: str, form: StitchFormat, view: Mapping[str, Any] = NOTHING, known: str | None = None
    ) -> bytes | None:
        """Return the zip with which other tools stitch; None: the one with the tag `known` is up to date.

        `view`: what is wanted otherwise than the venue's view has it, such as `width_px`. The tag is in `view.json`.
        """
        headers = {"If-None-Match": known} if known else {}
        path, params = f"/venues/{venue_id}/stitch", {"format": form, **view}
        response = await self._send("GET", path, params=params, headers=headers, timeout=PACKAGE_S)
        if response.status_code == HTTPStatus.NOT_MODIFIED:
            return None
        if not response.is_success:
            raise refusal(response)
        return response.content

    async def venue_events(
        self, venue_id: str, kinds: Sequence[EventKind] = (), seen: str | None = None, patience_s: float = math.inf
    ) -> AsyncGenerator[tuple[str, Event]]:
        """Yield the events of a venue (of these kinds, absent: of any), each with its id, for `seen`.

        The first is `poses.current`, or the one after the event `seen`. No event is missed or repeated when the
        connection breaks: the error is raised once the service was away for `patience_s`. A busy service is asked again
        when it says (Retry-After), at the latest after a minute. Ends when the venue is deleted; where that happened
        while nobody was connected, with `Refused` (404).
        """
        path, params = f"/venues/{venue_id}/events", {"events": list(kinds)}
        last_answer_s = time.monotonic()
        while True:
            pause_s = AGAIN_S
            try:
                headers = {"Last-Event-ID": seen} if seen else {}
                fields: dict[str, str] = {}
                async with aclosing(self._lines(path, params=params, headers=headers)) as lines:
                    async for line in lines:
                        name, _, value = line.partition(": ")
                        if name:
                            fields[name] = value
                        elif not line and "data" in fields:
                            seen, event = fields["id"], _parse_event(fields["data"])
                            if event is not None:
                                yield seen, event
                                if event.type == FINAL_EVENT:
                                    return
                            fields = {}
                        # Also after whoever asked has taken its time over an event.
                        last_answer_s = time.monotonic()
            except (httpx.TransportError, Refused) as error:
                if not is_passing(error) or time.monotonic() - last_answer_s > patience_s:
                    raise
                pause_s = pause_s_of(error, AGAIN_S)
            await self._pause(pause_s)

    async def report_live(self, venue_id: str, report: LiveReport) -> None:
        """Report the state of the live poses of a venue, as the process that sends them."""
        # A service need not know a field that has its default.
        content = report.model_dump(mode="json", exclude_defaults=True)
        await self._ask("PUT", f"/venues/{venue_id}/live", json=content, timeout=REPORT_S)

    async def live(self, venue_id: str) -> LiveState:
        """Return the newest report of each process that sends live poses of a venue."""
        return await self._call(LiveState, "GET", f"/venues/{venue_id}/live")

    async def live_history(self, venue_id: str, minutes: int = 60) -> LiveHistory:
        """Return the reports of live poses in the last `minutes`, by the minute."""
        params = {"minutes": minutes}
        return await self._call(LiveHistory, "GET", f"/venues/{venue_id}/live/history", params=params)

    async def snapshot(self, venue_id: str, camera: str) -> bytes:
        """Return what a camera shows now, a JPEG or PNG from its source."""
        return await self._ask("GET", f"/venues/{venue_id}/cameras/{camera}/snapshot")

    # Jobs

    async def calibrate(
        self, venue_id: str, files: Frames, options: Mapping[str, Any], idempotency_key: str | None = None
    ) -> Job:
        """Submit a frame of each camera, or several, or none: then they are fetched.

        The job may be an older one if the content is the same.
        """
        sent = _upload(files, options, idempotency_key)
        return await self._call(Job, "POST", f"/venues/{venue_id}/calibrate", **sent)

    async def fit_field(
        self, venue_id: str, files: Frames, options: Mapping[str, Any], idempotency_key: str | None = None
    ) -> Job:
        """Submit frames by which to fit the measures of a venue's pitch; the venue stays as it is."""
        sent = _upload(files, options, idempotency_key)
        return await self._call(Job, "POST", f"/venues/{venue_id}/field/fit", **sent)

    async def find(
        self,
        venue_id: str,
        files: Frames,
        options: Mapping[str, Any] = NOTHING,
        site: SoughtSite | None = None,
        idempotency_key: str | None = None,
    ) -> Job:
        """Submit frames of cameras that are to be found; `site`: of a venue that is not stored yet.

        Nothing is stored by itself, see `adopt_found`.
        """
        sent = _upload(files, options, idempotency_key)
        if site is not None:
            document = site.model_dump_json(exclude_defaults=True).encode()
            sent["files"].append((SITE_PART, ("site.json", document, "application/json")))
        return await self._call(Job, "POST", f"/venues/{venue_id}/find", **sent)

    async def check(
        self, calibration: Sequence[Path], files: Frames, options: Mapping[str, Any], idempotency_key: str | None = None
    ) -> Job:
        """Submit the files of a calibration of any tool, and frames of its cameras; `options` say the field."""
        sent = _upload(files, options, idempotency_key)
        sent["files"] += [(CALIBRATION_PART, (path.name, path.read_bytes(), OCTETS)) for path in calibration]
        return await self._call(Job, "POST", "/check", **sent)

    async def plan(self, site: PlannedSite, lines: LineStateName = "fresh", hidden: float = 0.0) -> PlanAnswer:
        """Return the plan of cameras before they are mounted, for lines of which something covers a share `hidden`."""
        sent = {"params": {"lines": lines, "hidden": hidden}, "json": site.model_dump(mode="json"), "timeout": PLAN_S}
        return await self._call(PlanAnswer, "POST", "/plan", **sent)

    async def job(self, job_id: str, wait_s: float = 0) -> Job:
        """Return a job, at its end or after `wait_s`."""
        params = {"wait": wait_s} if wait_s else {}
        return await self._call(Job, "GET", f"/jobs/{job_id}", params=params)

    async def jobs(
        self,
        venue: str | None = None,
        status: JobStatus | None = None,
        kind: JobKind | None = None,
        most: int | None = None,
    ) -> list[Job]:
        """Return jobs, newest first: of one venue, in one state, of one kind; `most`: so many of them."""
        filters = {name: value for name, value in (("venue", venue), ("status", status), ("kind", kind)) if value}
        page = await self._call(Jobs, "GET", "/jobs", params=filters)
        found = page.jobs
        while page.next_cursor is not None and (most is None or len(found) < most):
            more = filters | {"cursor": page.next_cursor}
            page = await self._call(Jobs, "GET", "/jobs", params=more)
            found += page.jobs
        return found[:most]

    async def again(self, job_id: str) -> Job:
        """Submit the frames of a job once more, from the poses in use: another job."""
        return await self._call(Job, "POST", f"/jobs/{job_id}/again")

    async def calibrate_found(self, job_id: str) -> Job:
        """Calibrate a venue with the frames of the search whose cameras `adopt_found` has stored."""
        return await self._call(Job, "POST", f"/jobs/{job_id}/calibrate")

    async def delete_job(self, job_id: str) -> None:
        """Forget a job that has ended, with its frames and pictures."""
        await self._ask("DELETE", f"/jobs/{job_id}")

    async def cancel(self, job_id: str) -> Job:
        """End a job."""
        return await self._call(Job, "POST", f"/jobs/{job_id}/cancel")

    async def accept(self, job_id: str, camera: str | None = None) -> Job:
        """Put the poses that a calibration found to use, of one camera or all, whatever the gate said."""
        params = {"camera": camera} if camera else {}
        return await self._call(Job, "POST", f"/jobs/{job_id}/accept", params=params)

    async def reject(self, job_id: str) -> Job:
        """Put back what was before the poses of a calibration."""
        return await self._call(Job, "POST", f"/jobs/{job_id}/reject")

    async def job_poses(
        self, job_id: str, form: FormatName, camera: str | None = None, lens: LensChoice = "stored"
    ) -> bytes:
        """Return the poses that a job found, of one camera or all, as a file of another tool's format."""
        return await self._ask("GET", f"/jobs/{job_id}/poses", params=_export_params(form, camera, lens))

    async def picture(self, of: Job, name: str) -> bytes | None:
        """Return a picture by the name of its link; None: the job made no such picture."""
        return await self._ask("GET", of.links[name]) if name in of.links else None

    async def follow(self, followed: Job, show: Callable[[Job], None] | None = None, every_s: float = 0.5) -> Job:
        """Wait for the end of a job; `show` is called as it goes on. The service may be away for a minute."""
        last_answer_s = time.monotonic()
        while followed.open:
            if show is not None:
                show(followed)
            try:
                followed = await self.job(followed.id, wait_s=every_s)
                last_answer_s = time.monotonic()
            except (httpx.TransportError, Refused) as error:
                if not is_passing(error) or time.monotonic() - last_answer_s > PATIENCE_S:
                    raise
                await self._pause(pause_s_of(error, every_s))
        return followed

    # Keys

    async def keys(self) -> list[ApiKey]:
        """Return all API keys, without the keys themselves."""
        return (await self._call(ApiKeys, "GET", "/keys")).keys

    async def add_key(self, wanted: KeyIn) -> MadeKey:
        """Make an API key; its secret is in this answer alone."""
        return await self._call(MadeKey, "POST", "/keys", json=wanted.model_dump(mode="json", exclude_defaults=True))

    async def revoke_key(self, name: str) -> None:
        """Revoke an API key."""
        await self._ask("DELETE", f"/keys/{name}")

    # Requests

    async def _call(self, model: type[Answer], method: str, path: str, **more: Any) -> Answer:
        """Return a successful answer as a model; raises `Refused` for others."""
        return _read(model, await self._ask(method, path, **more))

    async def _ask(self, method: str, path: str, **more: Any) -> bytes:
        """Return the body of a successful answer; raises `Refused` for others."""
        return (await self._answer(method, path, **more)).content

    async def _answer(self, method: str, path: str, **more: Any) -> httpx.Response:
        response = await self._send(method, path, **more)
        if not response.is_success:
            raise refusal(response)
        return response

    async def _send(self, method: str, path: str, **more: Any) -> httpx.Response:
        return await self._http.request(method, path, **more)

    async def _lines(self, path: str, **more: Any) -> AsyncGenerator[str]:
        """Yield the lines of a stream as they come; raises `Refused`.

        Split by LF alone, unlike those of httpx: names in events may contain separators of Unicode.
        """
        rest = b""
        async with aclosing(self._pieces(path, timeout=SILENCE_S, **more)) as pieces:
            async for piece in pieces:
                *lines, rest = (rest + piece).split(b"\n")
                for line in lines:
                    yield line.decode()

    async def _pieces(self, path: str, **more: Any) -> AsyncGenerator[bytes]:
        """Yield the bytes of a stream as they come; raises `Refused`."""
        async with self._http.stream("GET", path, **more) as response:
            if not response.is_success:
                await response.aread()
                raise refusal(response)
            async for piece in response.aiter_bytes():
                yield piece

    async def _pause(self, seconds: float) -> None:
        await asyncio.sleep(seconds)


class _Blocking(AsyncClient):
    """An `AsyncClient` over a connection that blocks: its coroutines never wait, and so end at their first step."""

    def __init__(self, url: str, api_key: str | None) -> None:
        self.http = httpx.Client(**_connection(url, api_key))

    async def _send(self, method: str, path: str, **more: Any) -> httpx.Response:
        return self.http.request(method, path, **more)

    async def _pieces(self, path: str, **more: Any) -> AsyncGenerator[bytes]:
        with self.http.stream("GET", path, **more) as response:
            if not response.is_success:
                response.read()
                raise refusal(response)
            for piece in response.iter_bytes():
                yield piece

    async def _pause(self, seconds: float) -> None:
        time.sleep(seconds)


class Client:
    """Client of the service at a URL, whose calls block."""

    def __init__(self, url: str, api_key: str | None = None) -> None:
        self.calls = _Blocking(url, api_key)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.calls.http.close()

    def url_of(self, path: str) -> str:
        """Return the address of a path that the service linked to."""
        return str(self.calls.http.build_request("GET", path).url)

    put_venue = blocking(AsyncClient.put_venue)
    patch_venue = blocking(AsyncClient.patch_venue)
    tagged_venue = blocking(AsyncClient.tagged_venue)
    venue = blocking(AsyncClient.venue)
    venues = blocking(AsyncClient.venues)
    venue_list = blocking(AsyncClient.venue_list)
    delete_venue = blocking(AsyncClient.delete_venue)
    venue_health = blocking(AsyncClient.venue_health)
    history = blocking(AsyncClient.history)
    trend = blocking(AsyncClient.trend)
    restore = blocking(AsyncClient.restore)
    adopt_refined = blocking(AsyncClient.adopt_refined)
    adopt_field = blocking(AsyncClient.adopt_field)
    adopt_found = blocking(AsyncClient.adopt_found)
    venue_poses = blocking(AsyncClient.venue_poses)
    venue_stitch = blocking(AsyncClient.venue_stitch)
    venue_events = blocking_stream(AsyncClient.venue_events)
    report_live = blocking(AsyncClient.report_live)
    live = blocking(AsyncClient.live)
    live_history = blocking(AsyncClient.live_history)
    snapshot = blocking(AsyncClient.snapshot)
    calibrate = blocking(AsyncClient.calibrate)
    fit_field = blocking(AsyncClient.fit_field)
    find = blocking(AsyncClient.find)
    check = blocking(AsyncClient.check)
    plan = blocking(AsyncClient.plan)
    job = blocking(AsyncClient.job)
    jobs = blocking(AsyncClient.jobs)
    again = blocking(AsyncClient.again)
    calibrate_found = blocking(AsyncClient.calibrate_found)
    delete_job = blocking(AsyncClient.delete_job)
    cancel = blocking(AsyncClient.cancel)
    accept = blocking(AsyncClient.accept)
    reject = blocking(AsyncClient.reject)
    job_poses = blocking(AsyncClient.job_poses)
    picture = blocking(AsyncClient.picture)
    follow = blocking(AsyncClient.follow)
    keys = blocking(AsyncClient.keys)
    add_key = blocking(AsyncClient.add_key)
    revoke_key = blocking(AsyncClient.revoke_key)


def _connection(url: str, api_key: str | None) -> dict[str, Any]:
    headers = {"Authorization": f"Bearer {api_key}"} if api_key else {}
    # Without TLS: reading the certificates of all authorities would take as long as a request.
    return {"base_url": url, "headers": headers, "timeout": TIMEOUT_S, "verify": not url.startswith("http://")}


def _read(model: type[Answer], answer: bytes) -> Answer:
    """Return an answer of a service of any version, without what this client does not know; raises `NotUnderstood`."""
    try:
        return model.model_validate_json(answer, **TOLERANTLY)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise NotUnderstood(f"{'.'.join(map(str, first['loc'])) or model.__name__}: {first['msg']}") from error


def _parse_event(data: str) -> Event | None:
    """Return an event; None: its type is one that only a newer service knows."""
    try:
        event = json.loads(data)
        known = event["type"] in EVENT_TYPES
        return _event().validate_python(event, **TOLERANTLY) if known else None
    except (ValueError, TypeError, KeyError) as error:
        raise NotUnderstood(f"{data[:100]} is no event") from error


@cache
def _event() -> TypeAdapter[Event]:
    return TypeAdapter(Event)


def _export_params(form: FormatName, camera: str | None, lens: LensChoice) -> dict[str, str]:
    # An older service knows no choice of lens, and has the stored one.
    lens_choice = {"lens": lens} if lens != "stored" else {}
    return {"format": form} | lens_choice | ({"camera": camera} if camera else {})


def _upload(files: Frames, options: Mapping[str, Any], idempotency_key: str | None) -> dict[str, Any]:
    parts: list[tuple[str, tuple[str, bytes, str]]] = [
        (camera, (path.name, path.read_bytes(), OCTETS))
        for camera, paths in files.items()
        for path in ([paths] if isinstance(paths, Path) else paths)
    ]
    # Never without a part: a form of none is none.
    if options or not parts:
        parts.append((OPTIONS_PART, ("options.json", json.dumps(options).encode(), "application/json")))
    return {"files": parts, "headers": {"Idempotency-Key": idempotency_key} if idempotency_key else {}}
