"""What schedules ask for becomes jobs, however full the queue is."""

import threading
from datetime import timedelta

import pytest
import sqlalchemy as sa

from service.home import Home
from service.settings import Settings
from service.store import tables
from service.store.counts.endings import ENDED
from service.store.counts.figures import look as look_at_figures
from service.wire.options import Options
from service.wire.problems import Problem
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


def put(home, name, options=None, alarms=None):
    schedule = {"cron": "*/15 * * * *", "options": options}
    document = venue(name, cameras=("left",)) | {"schedule": schedule, "alarms": alarms}
    document["cameras"][0]["source"] = "http://127.0.0.1/x"
    home.venues.put(VenueIn.model_validate(document).stored(), lambda _: None)


def all_due(home, minutes=1):
    """Let the times of all schedules have come so many minutes ago."""
    a_while_ago = home.schedules.now() - timedelta(minutes=minutes)
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


@in_both_homes
def test_a_camera_that_gives_no_frame_is_a_job_that_failed(home_of_schedules, duty, monkeypatch):
    home = home_of_schedules
    put(home, "v", alarms={"rejected_in_a_row": 2})
    gone = Problem(
        "source-failed", "No frame of camera left: answered 404.", camera="left", source="http://127.0.0.1/x"
    )

    def take(*_):
        raise gone

    monkeypatch.setattr(home.snapshots, "take", take)
    for minutes in (3, 2):
        all_due(home, minutes)
        look(duty)
    last, first = home.jobs.page("v", None, None, 10)
    assert (last.status, last.error.type, last.error.camera) == ("failed", "/problems/source-failed", "left")
    assert last.error.detail == home.venues.health("v").schedule.last_error == gone.detail
    assert home.venues.health("v").schedule.last_job == last.id != first.id
    assert [alarm.rule for alarm in home.venues.health("v").alarms] == ["rejected-in-a-row"]
    assert look_at_figures(home.engine, 1).tallies[ENDED, ("failed", "", "source-failed")] == 2
    # There is nothing to compute again, and nothing in the way of the next time.
    assert home.submissions.of(last.id) is None
    assert home.expiry.old_frames(home.schedules.now() + timedelta(days=1), 10) == []
    monkeypatch.setattr(home.snapshots, "take", lambda cameras, _: {camera.id: png() for camera in cameras})
    all_due(home)
    look(duty)
    assert [job.venue for job in waiting(home)] == ["v"]
    assert home.venues.health("v").schedule.last_error is None


@in_both_homes
def test_a_time_that_failed_and_is_fired_again_is_the_same_job(home_of_schedules, duty, monkeypatch):
    home = home_of_schedules
    put(home, "v")
    monkeypatch.setattr(home.snapshots, "take", lambda *_: fail_with("source-failed"))
    with monkeypatch.context() as patch:
        # The worker dies before it writes down that it is done.
        patch.setattr(home.schedules, "done", lambda *_: 1 / 0)
        all_due(home)
        look(duty)
    with home.engine.begin() as connection:
        connection.execute(sa.update(tables.schedules).values(look_at=tables.schedules.c.due_at))
    look(duty)
    (job,) = home.jobs.page("v", None, None, 10)
    assert home.venues.health("v").schedule.last_job == job.id


def test_a_schedule_says_how_it_is_to_be_calibrated(home_of_schedules, duty):
    home = home_of_schedules
    put(home, "v", options={"preset": "esc", "priority": "live", "dry_run": True})
    all_due(home)
    look(duty)
    (job,) = waiting(home)
    options = home.submissions.of(job.id).options
    assert (options.priority, options.dry_run) == ("live", True)


def fail_with(kind):
    raise Problem(kind, "No frame.", camera="left")


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
            assert put_through.wait(60)
        return {camera.id: png() for camera in cameras}

    slow = home.venues.get("a-slow")
    cameras = [camera.model_copy(update={"source": "http://127.0.0.1/slow"}) for camera in slow.cameras]
    home.venues.put(slow.model_copy(update={"cameras": cameras}), lambda _: None)
    monkeypatch.setattr(home.snapshots, "take", take)
    duty.look()
    # What is being fired is due no earlier than in ten minutes.
    put(home, "c")
    with home.engine.begin() as connection:
        due = sa.update(tables.schedules).where(tables.schedules.c.venue == "c")
        connection.execute(due.values(due_at=home.schedules.now(), look_at=home.schedules.now()))
    while "c" not in [job.venue for job in waiting(home)]:
        duty.look()
    put_through.set()
    duty.finish()
