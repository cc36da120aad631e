"""The Python client, both ways, against a real service."""

import asyncio
import inspect
import threading
import time
from contextlib import aclosing, contextmanager
from datetime import UTC, datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import islice

import httpx
import pytest

from service import client as client_module
from service import client_errors as refused_module
from service.client import AsyncClient, Client, Refused
from service.formats.conversion import members_of, write_cameras
from service.formats.records import CameraRecord
from service.schemas.check import CheckResult
from service.schemas.events.venue_event import VenueChange, VenueEvent
from service.schemas.field import FieldOfPlay
from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.health import AlarmEvent, VenueAlarm
from service.schemas.plan import PlannedSite
from service.schemas.results import FindResult
from service.schemas.venue import VenueIn
from testbed.running import DEADLINE_S, png, venue, wait_for


@pytest.fixture
def frames(tmp_path):
    files = {side: [tmp_path / f"{side}.png"] for side in ("left", "right")}
    for (file,) in files.values():
        file.write_bytes(png())
    return files


def test_a_year_in_the_life_of_a_venue_by_blocking_calls(service, frames, name):
    shown = []
    with Client(service.url) as client:
        client.put_venue(VenueIn.model_validate(venue(name, "reject 0.5")))
        job = client.follow(client.calibrate(name, frames, {"seed": 1}), shown.append)
        assert (job.status, shown[0].open) == ("succeeded", True)
        assert client.picture(job, "birdseye").startswith(b"\xff\xd8")
        assert client.picture(job, "preview") is None
        assert client.accept(job.id).venue_revision == 2
        assert [revision.cause for revision in client.history(name)] == ["accepted", "put"]
        assert len(client.history(name, 1)) == 1
        assert client.restore(name, 1).cameras[0].pose.position[0] == -1.0
        assert client.venue_health(name).revision == 3
        assert client.job_poses(job.id, "json").startswith(b"{")
        assert name in [one.id for one in client.venues()]
        client.delete_venue(name)
        with pytest.raises(Refused, match="There is no such venue") as refused:
            client.venue(name)
    assert (refused.value.status, refused.value.busy) == (404, False)


def test_a_venue_begins_with_frames_and_a_sport(service, frames, name):
    cameras = [SoughtCameraIn(id=side, side="near") for side in frames]
    site = SoughtSite(id=name, name="partly", field=FieldOfPlay(template="football"), cameras=cameras)
    with Client(service.url) as client:
        job = client.follow(client.find(name, frames, {"seed": 1}, site), print)
        assert isinstance(job.result, FindResult)
        assert [camera.reason for camera in job.result.cameras] == [None, "not-unique"]
        assert client.picture(job, "candidate/right/2").startswith(b"\xff\xd8")
        stored = client.adopt_found(name, job.id, {"right": 2})
        assert [camera.pose.position[1] for camera in stored.cameras] == [-40, -60]
        again = client.follow(client.find(name, {"left": frames["left"]}, {"find_lens": True}), print)
        assert [camera.id for camera in again.result.cameras] == ["left"]


def test_the_calibration_of_a_tool_is_checked(service, frames, tmp_path):
    camera = VenueIn.model_validate(venue("any")).to_venue().cameras[0]
    record = CameraRecord("left", camera.intrinsics, (64, 48), camera.pose)
    ((file, content),) = members_of(write_cameras([record], "pose2sim"), "left").items()
    calibration = tmp_path / file
    calibration.write_bytes(content)
    with Client(service.url) as client:
        job = client.follow(client.check([calibration], {"left": frames["left"]}, {"field": {"template": "tennis"}}))
    assert isinstance(job.result, CheckResult)
    assert (job.result.format, job.result.grade) == ("pose2sim", "good")


def test_cameras_are_planned_before_there_is_a_venue(service):
    stand = {"id": "mast", "position": [0.0, -12.0, 5.0], "cameras": 2, "image_size": [1920, 1080]}
    site = PlannedSite.model_validate({"field": {"template": "volleyball"}, "stands": [stand]})
    with Client(service.url) as client:
        made = client.plan(site, "worn", 0.1)
    assert [camera.id for camera in made.plan.cameras] == ["mast-1", "mast-2"]
    assert (made.plan.lines, made.plan.hidden) == ("worn", 0.1)


def test_the_same_without_blocking(service, frames, name):
    async def life():
        async with AsyncClient(service.url) as client:
            await client.put_venue(VenueIn.model_validate(venue(name, "accept 0.5")))
            submitted = await client.calibrate(name, {side: file for side, (file,) in frames.items()}, {"seed": 1})
            shown = []
            job, there = await asyncio.gather(client.follow(submitted, shown.append), client.venue(name))
            assert (job.status, there.id, shown[0].open) == ("succeeded", name, True)
            with pytest.raises(Refused, match="There is no such venue"):
                await client.venue("nowhere")
            return await client.history(name)

    assert [revision.cause for revision in asyncio.run(life())] == ["calibrated", "put"]


def test_both_clients_have_the_same_methods_with_the_same_signatures():
    clients = Client("http://127.0.0.1:9"), AsyncClient("http://127.0.0.1:9")
    names = [name for name in dir(Client) if not name.startswith("_") and name != "url_of"]
    assert len(names) == 40
    for name in names:
        blocking, awaited = (getattr(client, name) for client in clients)
        assert inspect.signature(blocking) == inspect.signature(awaited)
        assert blocking.__doc__


@pytest.mark.long
def test_who_follows_a_job_outlives_a_restart_of_the_service(start, frames):
    service = start().ready()
    port = httpx.URL(service.url).port
    restarted = []

    def restart(job):
        if not restarted:
            service.kill()
            service.start(port)
            restarted.append(job.id)

    with Client(service.url) as client:
        client.put_venue(VenueIn.model_validate(venue("v", "accept 1")))
        job = client.follow(client.calibrate("v", frames, {}), restart)
    assert (job.status, restarted) == ("succeeded", [job.id])
    wait_for(lambda: service.http.get("/livez").status_code == 200)


def test_who_follows_a_venue_misses_nothing_and_hears_nothing_twice_when_the_service_restarts(start):
    service = start().ready()
    port = httpx.URL(service.url).port
    service.venue("v")
    told = []
    with Client(service.url) as client:
        for _, event in client.venue_events("v", ["poses.changed"]):
            told.append((event.type, getattr(event.data, "revision", None)))
            if len(told) == 1:
                service.calibrated("v")
            elif len(told) == 2:
                service.kill()
                service.start(port)
                service.calibrated("v", shade=1)
            elif len(told) == 3:
                service.http.delete("/venues/v").raise_for_status()
        everything = [("poses.current", 1), ("poses.changed", 2), ("poses.changed", 3), ("venue.deleted", None)]
        assert told == everything
        with pytest.raises(Refused, match="There is no such venue"):
            next(client.venue_events("v"))


def test_who_follows_a_venue_goes_on_where_somebody_else_has_ended(service, name):
    service.venue(name)
    with Client(service.url) as client:
        ((seen, current),) = islice(client.venue_events(name), 1)
        assert current.data.cameras[0].pose == client.venue(name).cameras[0].pose
        job = service.calibrated(name)["id"]

    async def rest():
        async with AsyncClient(service.url) as client, aclosing(client.venue_events(name, seen=seen)) as events:
            return [(await anext(events))[1] for _ in range(3)]

    queued, changed, ended = asyncio.run(rest())
    assert [event.type for event in (queued, changed, ended)] == ["job.queued", "poses.changed", "job.succeeded"]
    assert (changed.data.job, ended.data.id) == (job, job)


def test_who_follows_a_venue_of_a_service_that_stays_away_is_told_in_the_end(monkeypatch):
    monkeypatch.setattr(client_module, "AGAIN_S", 0.05)
    with Client("http://127.0.0.1:9") as client, pytest.raises(httpx.ConnectError):
        next(client.venue_events("v", patience_s=0.2))


def test_a_follower_that_leaves_off_makes_room_for_another(start):
    service = start("serve", ESC_FOLLOWERS="1")
    service.venue("v")
    with Client(service.url) as client:
        for _ in range(3):
            events = client.venue_events("v", patience_s=DEADLINE_S)
            assert next(events)[1].type == "poses.current"
            events.close()


MOMENT = datetime(2026, 11, 21, 10, tzinfo=UTC)
DELETED = VenueEvent(type="venue.deleted", timestamp=MOMENT, data=VenueChange(venue="v", changed=[]))


def stream_of(*events):
    """As the service sends them."""
    said = (f": ping\n\nid: {number}\ndata: {event.model_dump_json()}\n\n" for number, event in enumerate(events))
    return "".join(said).encode()


def answered(content):
    """A connection on which every answer has this content: the bytes of a stream."""
    return {
        "transport": httpx.MockTransport(lambda _: httpx.Response(200, content=content())),
        "base_url": "http://esc",
    }


def test_whatever_a_name_in_an_event_is_made_of_the_event_arrives_as_it_was(monkeypatch):
    why = "line \u2028 \x85 \x1e end"
    alarm = VenueAlarm(rule="not-calibrated", camera=None, since=MOMENT, why=why, venue="v")
    events = [AlarmEvent(type="alarm.began", timestamp=MOMENT, data=alarm), DELETED]

    def piecemeal():
        """In pieces that end in the middle of lines and of characters."""
        return (bytes([byte]) for byte in stream_of(*events))

    async def awaited():
        for piece in piecemeal():
            yield piece

    async def told():
        async with AsyncClient("http://esc") as client:
            monkeypatch.setattr(client, "_http", httpx.AsyncClient(**answered(awaited)))
            return [event async for _, event in client.venue_events("v")]

    with Client("http://esc") as client:
        monkeypatch.setattr(client.calls, "http", httpx.Client(**answered(piecemeal)))
        assert [event for _, event in client.venue_events("v")] == events
    assert asyncio.run(told()) == events


def test_who_takes_time_over_an_event_does_not_take_the_service_for_away(monkeypatch):
    monkeypatch.setattr(client_module, "AGAIN_S", 0.0)
    created = DELETED.model_copy(update={"type": "venue.created"})

    def breaks_off():
        yield stream_of(created)
        raise httpx.ReadError("gone")

    streams = [breaks_off(), iter([stream_of(DELETED)])]
    with Client("http://esc") as client:
        monkeypatch.setattr(client.calls, "http", httpx.Client(**answered(lambda: streams.pop(0))))
        told = []
        for _, event in client.venue_events("v", patience_s=0.1):
            told.append(event)
            time.sleep(0.2)
    assert told == [created, DELETED]


@contextmanager
def busy_service(retry_after):
    """A service that is busy once and then has one event; yields its address and when it was asked."""
    asked = []

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(time.monotonic())
            if len(asked) == 1:
                self.send_response(503)
                self.send_header("Retry-After", retry_after)
            else:
                self.send_response(200)
            content = stream_of(DELETED) if len(asked) > 1 else b"{}"
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_):
            """Not into the output of the tests."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}", asked
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize(
    ("retry_after", "longest_s", "least_s"),
    [("1", 60.0, 1.0), ("86400", 0.5, 0.5), ("0", 60.0, 0.05), ("Wed, 21 Oct 2026 07:28:00 GMT", 60.0, 0.05)],
)
@pytest.mark.parametrize("blocking", [True, False])
def test_a_busy_service_is_asked_again_when_it_says(retry_after, longest_s, least_s, blocking, monkeypatch):
    monkeypatch.setattr(client_module, "AGAIN_S", 0.05)
    monkeypatch.setattr(refused_module, "LONGEST_PAUSE_S", longest_s)

    async def awaited(url):
        async with AsyncClient(url) as client:
            return [event async for _, event in client.venue_events("v")]

    with busy_service(retry_after) as (url, asked):
        if blocking:
            with Client(url) as client:
                told = [event for _, event in client.venue_events("v")]
        else:
            told = asyncio.run(awaited(url))
    assert told == [DELETED]
    first, second = asked
    # Whatever a busy machine adds.
    assert least_s <= second - first < 60.0
