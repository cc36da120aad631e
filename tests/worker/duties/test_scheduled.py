"""What schedules ask for becomes jobs, however full the queue is."""

import threading
from datetime import timedelta

import pytest
import sqlalchemy as sa

from service.home import Home
from service.settings import Settings
from service.store import tables
from service.wire.options import Options
from service.wire.venue import VenueIn
from tests.e2e.running import png, venue
from tests.homes import in_both_homes
from worker.duties import scheduled
from worker.duties.scheduled import PUT_OFF, Scheduled

LIMIT, VENUES = 3, 8


@pytest.fixture
def home_of_schedules(home, tmp_path, monkeypatch):
    """A home whose queue is short; its cameras show something at once."""
    made = Home(Settings(data=tmp_path, queue_limit=LIMIT, sources=["127.0.0.1"], **home.settings(tmp_path)))
    monkeypatch.setattr(made.snapshots, "take", lambda cameras, _: {camera.id: png() for camera in cameras})
    yield made
    made.close()


@pytest.fixture
def duty(home_of_schedules):
    made = home_of_schedules
    return Scheduled(made.settings, made.schedules, made.venues, made.submissions, made.from_sources, made.disk)


def put(home, name):
    document = venue(name, cameras=("left",)) | {"schedule": {"cron": "*/15 * * * *"}}
    document["cameras"][0]["source"] = "http://127.0.0.1/x"
    home.venues.put(VenueIn.model_validate(document).stored(), lambda _: None)


def all_due(home):
    """Let the times of all schedules have come a while ago."""
    a_while_ago = home.schedules.now() - timedelta(minutes=1)
    with home.engine.begin() as connection:
        connection.execute(sa.update(tables.schedules).values(due_at=a_while_ago, look_at=a_while_ago))


def look(duty, times=1):
    for _ in range(times):
        duty.look()
        duty.finish()


def waiting(home):
    return home.jobs.page(None, "queued", None, 100)


@in_both_homes
def test_more_venues_than_the_queue_takes_are_all_calibrated_in_the_end(home_of_schedules, duty):
    home = home_of_schedules
    for number in range(VENUES):
        put(home, f"v{number}")
    all_due(home)
    calibrated = []
    for _ in range(VENUES):
        look(duty, times=3)
        jobs = waiting(home)
        assert len(jobs) <= LIMIT
        for job in jobs:
            calibrated.append(job.venue)
            home.decisions.cancel(job.id)
    assert sorted(calibrated) == [f"v{number}" for number in range(VENUES)]


def test_a_full_queue_has_no_frames_fetched_in_vain(home_of_schedules, duty, monkeypatch):
    home = home_of_schedules
    for number in range(LIMIT):
        put(home, f"other{number}")
        home.from_sources.calibrate(f"other{number}", Options(), None, scheduled.Origin())
    put(home, "v")
    all_due(home)
    monkeypatch.setattr(home.snapshots, "take", lambda *_: pytest.fail("fetched"))
    look(duty)
    assert home.venues.health("v").schedule.last_error is None


@in_both_homes
def test_a_venue_that_is_being_calibrated_is_put_off_and_not_forgotten(home_of_schedules, duty):
    home = home_of_schedules
    put(home, "v")
    by_hand, _ = home.from_sources.calibrate("v", Options(seed=3), None, scheduled.Origin())
    all_due(home)
    due = home.venues.health("v").schedule.next_at
    look(duty)
    state = home.venues.health("v").schedule
    assert (state.next_at, state.last_job) == (due, None)
    assert "active job" in state.last_error
    home.decisions.cancel(by_hand.id)
    look(duty)
    assert waiting(home) == []
    with home.engine.begin() as connection:
        s = tables.schedules.c
        sooner = home.schedules.now() - PUT_OFF
        connection.execute(sa.update(tables.schedules).where(s.venue == "v").values(look_at=sooner))
    look(duty)
    (job,) = waiting(home)
    assert home.venues.health("v").schedule.last_job == job.id
    assert home.venues.health("v").schedule.last_error is None


def test_those_that_were_put_off_go_before_those_that_came_after(home_of_schedules):
    home = home_of_schedules
    for name in ("late", "early"):
        put(home, name)
    now = home.schedules.now()
    with home.engine.begin() as connection:
        s = tables.schedules.c
        # It was put off until now, and the other one becomes due.
        early = {"due_at": now - timedelta(minutes=15), "look_at": now}
        connection.execute(sa.update(tables.schedules).values(due_at=now, look_at=now - timedelta(seconds=1)))
        connection.execute(sa.update(tables.schedules).where(s.venue == "early").values(**early))
    assert [firing.venue_id for firing in home.schedules.fire(now, now + timedelta(minutes=1), 1)] == ["early"]


def test_a_camera_that_is_slow_holds_up_no_other_venue(home_of_schedules, duty, monkeypatch):
    home, put_through = home_of_schedules, threading.Event()
    for name in ("a-slow", "b"):
        put(home, name)
    all_due(home)

    def take(cameras, _):
        if cameras[0].source.endswith("slow"):
            put_through.wait(60)
        return {camera.id: png() for camera in cameras}

    slow = home.venues.get("a-slow")
    cameras = [camera.model_copy(update={"source": "http://127.0.0.1/slow"}) for camera in slow.cameras]
    home.venues.put(slow.model_copy(update={"cameras": cameras}), lambda _: None)
    monkeypatch.setattr(home.snapshots, "take", take)
    duty.look()
    put(home, "c")
    all_due(home)
    while "c" not in [job.venue for job in waiting(home)]:
        duty.look()
    put_through.set()
    duty.finish()
