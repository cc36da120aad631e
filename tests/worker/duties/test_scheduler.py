"""What schedules ask for becomes jobs, however full the queue is."""

import socket
import threading
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.application_state import ApplicationState
from service.intake.snapshots import SourceLate
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.venue import VenueIn
from service.settings import Settings
from service.store import tables
from service.store.jobs.queries import JobPage
from service.store.statistics.job_outcome import ENDED
from service.store.statistics.snapshot import read_statistics as look_at_figures
from testbed.homes import in_both_homes
from testbed.network_cameras import NetworkCamera
from testbed.running import png, venue, wait_for
from worker.duties import scheduler
from worker.duties.scheduler import DEFER, Scheduler

pytestmark = pytest.mark.slow

LIMIT, VENUES = 3, 8
# Several times as many as are fetched from at once.
SILENT = 20


def shows(cameras, _, frames=1, spacing_s=0, within_s=None):
    """What cameras show that answer at once."""
    return {camera.id: [png()] * frames for camera in cameras}


@pytest.fixture
def app(home, tmp_path, monkeypatch):
    """An application whose queue is short; its cameras show something at once."""
    home.make_database(tmp_path)
    made = ApplicationState(
        Settings(data=tmp_path, queue_limit=LIMIT, sources=["127.0.0.1"], **home.settings(tmp_path))
    )
    monkeypatch.setattr(made.snapshots, "take_of_all", shows)
    yield made
    made.close()
    home.give_back(tmp_path)


@pytest.fixture
def duty(app):
    return Scheduler(app)


def put(app, name, options=None, alarms=None, source="http://127.0.0.1/x", **more):
    schedule = {"cron": "*/15 * * * *", "options": options} | more
    document = venue(name, cameras=("left",)) | {"schedule": schedule, "alarms": alarms}
    document["cameras"][0]["source"] = source
    app.venues.put(VenueIn.model_validate(document).to_venue())


def all_due(app, minutes=1):
    """Let the times of all schedules have come so many minutes ago."""
    a_while_ago = app.schedules.now() - timedelta(minutes=minutes)
    set_times(app, due_at=a_while_ago, look_at=a_while_ago)


def set_times(app, *venues, **times):
    """Write times of the schedules of these venues, or of all."""
    every = sa.update(tables.schedules)
    chosen = every.where(tables.schedules.c.venue.in_(venues)) if venues else every
    with app.engine.begin() as connection:
        connection.execute(chosen.values(times))


def poll_until(duty, condition):
    """Poll with pauses, as a worker does, until a condition is true; return what it is."""

    def polled():
        duty.poll()
        return condition()

    return wait_for(polled)


def look(duty, times=1):
    for _ in range(times):
        duty.poll()
        duty.finish()


def waiting(app):
    return app.jobs.page(JobPage(100, status="queued")).jobs


@in_both_homes
def test_more_venues_than_the_queue_takes_are_all_calibrated_in_the_end(app, duty):
    for number in range(VENUES):
        put(app, f"v{number}")
    all_due(app)
    calibrated = []
    for _ in range(VENUES):
        look(duty, times=3)
        jobs = waiting(app)
        assert len(jobs) <= LIMIT
        for job in jobs:
            calibrated.append(job.venue)
            app.decisions.cancel(job.id)
    assert sorted(calibrated) == [f"v{number}" for number in range(VENUES)]


def test_a_full_queue_has_no_frames_fetched_in_vain(app, duty, monkeypatch):
    for number in range(LIMIT):
        put(app, f"other{number}")
        app.from_sources.calibrate(f"other{number}", Options(), None, scheduler.Origin())
    put(app, "v")
    all_due(app)
    monkeypatch.setattr(app.snapshots, "take_of_all", lambda *_: pytest.fail("fetched"))
    look(duty)
    assert app.venues.health("v").schedule.last_error is None


def test_frames_that_are_being_fetched_have_their_place_in_the_queue(app, duty, monkeypatch):
    answered = threading.Event()
    names = [f"v{number}" for number in range(VENUES)]
    for name in names:
        put(app, name)
    all_due(app)
    monkeypatch.setattr(scheduler, "POLL_S", 0.0)
    monkeypatch.setattr(app.snapshots, "take_of_all", lambda *one, **more: answered.wait(60) and shows(*one, **more))
    duty.poll()
    duty.poll()
    answered.set()
    duty.finish()
    assert len(waiting(app)) == LIMIT
    assert {app.venues.health(name).schedule.last_error for name in names} == {None}


def test_a_venue_that_is_being_calibrated_is_put_off_and_not_forgotten(app, duty):
    put(app, "v")
    by_hand, _ = app.from_sources.calibrate("v", Options(seed=3), None, scheduler.Origin())
    all_due(app)
    due = app.venues.health("v").schedule.next_at
    look(duty)
    state = app.venues.health("v").schedule
    assert (state.next_at, state.last_job) == (due, None)
    assert "active job" in state.last_error
    app.decisions.cancel(by_hand.id)
    look(duty)
    assert waiting(app) == []
    set_times(app, "v", look_at=app.schedules.now() - DEFER)
    look(duty)
    (job,) = waiting(app)
    assert app.venues.health("v").schedule.last_job == job.id
    assert app.venues.health("v").schedule.last_error is None


def test_a_venue_that_cannot_be_read_says_so_and_fires_again_at_its_next_time(app, duty):
    for name in ("broken", "v"):
        put(app, name)
    all_due(app)
    with app.engine.begin() as connection:
        is_broken = tables.venues.c.id == "broken"
        connection.execute(sa.update(tables.venues).where(is_broken).values(document={"id": "broken"}))
    look(duty)
    assert [job.venue for job in waiting(app)] == ["v"]
    state = app.venues.health("broken").schedule
    assert (state.next_at > app.schedules.now(), "cannot be read" in state.last_error) == (True, True)


def test_a_camera_that_gives_no_frame_is_a_job_that_failed(app, duty, monkeypatch):
    put(app, "v", alarms={"rejected_in_a_row": 2})
    gone = Problem(
        "source-failed", "No frame of camera left: answered 404.", camera="left", source="http://127.0.0.1/x"
    )

    def take(*_):
        raise gone

    monkeypatch.setattr(app.snapshots, "take_of_all", take)
    for minutes in (3, 2):
        all_due(app, minutes)
        look(duty)
    last, first = app.jobs.page(JobPage(10, venue="v")).jobs
    assert (last.status, last.error.type, last.error.camera) == ("failed", "/problems/source-failed", "left")
    assert last.error.detail == app.venues.health("v").schedule.last_error == gone.detail
    assert app.venues.health("v").schedule.last_job == last.id != first.id
    assert [alarm.rule for alarm in app.venues.health("v").alarms] == ["rejected-in-a-row"]
    assert look_at_figures(app.engine, 1).counters[ENDED, ("failed", "", "source-failed")] == 2
    # There is nothing to compute again, and nothing in the way of the next time.
    assert app.submissions.of(last.id) is None
    assert app.expiry.old_frames(app.schedules.now() + timedelta(days=1), 10) == []
    monkeypatch.setattr(app.snapshots, "take_of_all", shows)
    all_due(app)
    look(duty)
    assert [job.venue for job in waiting(app)] == ["v"]
    assert app.venues.health("v").schedule.last_error is None


@in_both_homes
def test_a_time_that_failed_and_is_fired_again_is_the_same_job(app, duty, monkeypatch):
    put(app, "v")
    monkeypatch.setattr(app.snapshots, "take_of_all", lambda *_: fail_with("source-failed"))
    with monkeypatch.context() as patch:
        # The worker dies before it writes down that it is done.
        patch.setattr(app.schedules, "done", lambda *_: 1 / 0)
        all_due(app)
        look(duty)
    set_times(app, look_at=tables.schedules.c.due_at)
    look(duty)
    (job,) = app.jobs.page(JobPage(10, venue="v")).jobs
    assert app.venues.health("v").schedule.last_job == job.id


def test_a_schedule_says_how_it_is_to_be_calibrated(app, duty):
    put(app, "v", options={"preset": "esc", "priority": "live", "dry_run": True})
    all_due(app)
    look(duty)
    (job,) = waiting(app)
    options = app.submissions.of(job.id).options
    assert (options.priority, options.dry_run) == ("live", True)


def test_a_schedule_may_have_several_frames_of_each_camera_fused(app, duty, monkeypatch):
    asked = []

    def take(cameras, _, frames, spacing_s, within_s):
        asked.append((frames, spacing_s))
        return {camera.id: [png(shade=shade) for shade in range(frames)] for camera in cameras}

    monkeypatch.setattr(app.snapshots, "take_of_all", take)
    put(app, "v", frames=3, spacing_s=2.5)
    all_due(app)
    look(duty)
    (job,) = waiting(app)
    paths = app.submissions.of(job.id).frames["left"]
    assert [app.blobs.get(path) for path in paths] == [png(shade=shade) for shade in range(3)]
    assert asked == [(3, 2.5)]


def fail_with(kind):
    raise Problem(kind, "No frame.", camera="left")


def test_those_that_were_put_off_go_before_those_that_came_after(app):
    for name in ("late", "early"):
        put(app, name)
    now = app.schedules.now()
    # It was put off until now, and the other one becomes due.
    set_times(app, "late", due_at=now, look_at=now - timedelta(seconds=1))
    set_times(app, "early", due_at=now - timedelta(minutes=15), look_at=now)
    assert [firing.venue for firing in app.schedules.claim_due(now, now + timedelta(minutes=1), 1)] == ["early"]


def test_a_camera_that_is_slow_holds_up_no_other_venue(app, duty, monkeypatch):
    put_through = threading.Event()
    for name in ("a-slow", "b"):
        put(app, name)
    all_due(app)

    def take(cameras, *_):
        if cameras[0].source.endswith("slow"):
            assert put_through.wait(60)
        return shows(cameras, *_)

    slow = app.venues.get("a-slow")
    cameras = [camera.model_copy(update={"source": "http://127.0.0.1/slow"}) for camera in slow.cameras]
    app.venues.put(slow.model_copy(update={"cameras": cameras}))
    monkeypatch.setattr(app.snapshots, "take_of_all", take)
    duty.poll()
    # What is being fired is due no earlier than in ten minutes.
    put(app, "c")
    set_times(app, "c", due_at=app.schedules.now(), look_at=app.schedules.now())
    poll_until(duty, lambda: "c" in [job.venue for job in waiting(app)])
    put_through.set()
    duty.finish()


def test_venues_whose_cameras_answer_do_not_wait_for_silent_ones(app, duty, monkeypatch):
    given_up = threading.Event()
    silent = [f"silent-{number}" for number in range(3 * scheduler.AT_ONCE)]
    for name in silent:
        put(app, name, source="http://127.0.0.1/silent")

    def take(cameras, _, frames, spacing_s, within_s):
        if not cameras[0].source.endswith("silent"):
            return shows(cameras, _)
        if within_s is None:
            assert given_up.wait(60)
        raise SourceLate("source-failed", "No frame.", camera="left")

    monkeypatch.setattr(app.snapshots, "take_of_all", take)
    all_due(app, minutes=2)
    # Each is tried once where others wait for it, and from then on where only its like do.
    poll_until(duty, lambda: not look_at_figures(app.engine, 1).schedules_late_s[0])
    put(app, "live")
    set_times(app, "live", due_at=app.schedules.now(), look_at=app.schedules.now())
    assert [job.venue for job in poll_until(duty, lambda: waiting(app))] == ["live"]
    answered, silent_ones = look_at_figures(app.engine, 1).schedules_late_s
    # Its job waits a moment before its schedule is done.
    assert answered < 30
    assert silent_ones >= 120
    given_up.set()
    poll_until(duty, lambda: not look_at_figures(app.engine, 1).schedules_late_s[1])
    assert sorted(job.venue for job in app.jobs.page(JobPage(100, status="failed")).jobs) == sorted(silent)


@contextmanager
def hosts_that_accept_nobody(count):
    """Ports of addresses of their own, whose queues of connections are full: who connects waits for ever."""
    with ExitStack() as open_sockets:
        addresses = []
        for number in range(1, count + 1):
            server = open_sockets.enter_context(socket.socket())
            server.bind((f"127.0.1.{number}", 0))
            server.listen(0)
            addresses.append(server.getsockname())
            for _ in range(2):
                client = open_sockets.enter_context(socket.socket())
                client.setblocking(False)
                client.connect_ex(server.getsockname())
        yield [f"http://{host}:{port}/" for host, port in addresses]


@pytest.fixture
def roomy(tmp_path):
    """An application with room for the jobs of many venues, and real cameras."""
    made = ApplicationState(Settings(data=tmp_path, sources=["127.0.0.0/8"], source_timeout_s=3))
    yield made
    made.close()


def quick_fetches(app, monkeypatch):
    """The venues' sources that are fetched from in the quick lane, as they are."""
    fetched_from, take = [], app.snapshots.take_of_all

    def noted(cameras, credentials, frames, spacing_s, within_s):
        if within_s is not None:
            fetched_from.append(cameras[0].source)
        return take(cameras, credentials, frames, spacing_s, within_s)

    monkeypatch.setattr(app.snapshots, "take_of_all", noted)
    return fetched_from


def fire_until_a_job_waits(app):
    duty = Scheduler(app)
    all_due(app)
    assert [job.venue for job in poll_until(duty, lambda: waiting(app))] == ["z-live"]
    duty.finish()


@pytest.mark.long
def test_many_silent_cameras_of_a_host_hold_up_no_live_one_the_first_time(roomy, monkeypatch):
    monkeypatch.setattr(scheduler, "QUICK_S", 2.0)
    fetched_from, camera = quick_fetches(roomy, monkeypatch), NetworkCamera()
    with socket.create_server(("127.0.0.1", 0), backlog=1000) as silent:
        address = "http://{}:{}/".format(*silent.getsockname())
        for number in range(SILENT):
            put(roomy, f"silent-{number}", source=f"{address}{number}")
        put(roomy, "z-live", source=camera.url("/ok"))
        fire_until_a_job_waits(roomy)
    camera.close()
    # Those that were begun before the first had had their time, and of the others none.
    assert len([source for source in fetched_from if source != camera.url("/ok")]) <= 2 * scheduler.AT_ONCE


def test_from_cameras_that_cannot_be_connected_to_nothing_is_fetched_while_others_wait(roomy, monkeypatch):
    fetched_from, camera = quick_fetches(roomy, monkeypatch), NetworkCamera()
    with hosts_that_accept_nobody(SILENT) as addresses:
        for number, address in enumerate(addresses):
            put(roomy, f"dead-{number}", source=address)
        put(roomy, "z-live", source=camera.url("/ok"))
        fire_until_a_job_waits(roomy)
    camera.close()
    assert fetched_from == [camera.url("/ok")]


def test_a_camera_that_takes_long_is_given_its_time_in_the_slow_lane_and_comes_back_once_it_is_quick(
    app, duty, monkeypatch
):
    asked = []
    put(app, "v")

    def take(cameras, _, frames, spacing_s, within_s):
        asked.append(within_s)
        if within_s is not None:
            raise SourceLate("source-failed", "No frame.", camera="left")
        return shows(cameras, _)

    monkeypatch.setattr(app.snapshots, "take_of_all", take)
    for minutes in (8, 7):
        all_due(app, minutes)
        look(duty, times=2)
        (job,) = waiting(app)
        app.decisions.cancel(job.id)
    # The first time it was tried quickly, went to the slow lane and was not slow there.
    assert asked == [scheduler.QUICK_S, None] * 2
    monkeypatch.setattr(scheduler, "QUICK_S", -1.0)
    for minutes in (6, 5):
        all_due(app, minutes)
        look(duty, times=2)
        (job,) = waiting(app)
        app.decisions.cancel(job.id)
    # The second time it was known to be slow.
    assert asked[4:] == [-1.0, None, None]


@in_both_homes
def test_schedules_that_a_clock_was_ahead_for_fire_at_their_next_time(app, duty):
    for name in ("waits", "claimed"):
        put(app, name)
    look(duty)
    now = app.schedules.now()
    hours = timedelta(hours=6)
    # As a worker left them whose clock was six hours ahead: one waits for its next time, the other was being fired.
    set_times(app, "waits", due_at=now + hours, look_at=now + hours)
    set_times(app, "claimed", due_at=now - timedelta(minutes=1), look_at=now + hours)
    restarted = Scheduler(app)
    look(restarted)
    assert [job.venue for job in waiting(app)] == ["claimed"]
    for name in ("waits", "claimed"):
        assert app.venues.health(name).schedule.next_at <= now + timedelta(minutes=31)


@in_both_homes
def test_a_clock_that_is_put_right_while_a_worker_runs_delays_no_schedule(app, duty, monkeypatch):
    due = app.schedules.due
    put(app, "v")
    hours = timedelta(hours=6)
    with monkeypatch.context() as patch:
        patch.setattr(app.schedules, "now", lambda: datetime.now(UTC) + hours)
        patch.setattr(app.schedules, "due", lambda: replace(due(), now=datetime.now(UTC) + hours, quick=1))
        all_due(app, minutes=0)
        look(duty)
    assert [job.venue for job in waiting(app)] == ["v"]
    assert app.venues.health("v").schedule.next_at > datetime.now(UTC) + hours
    look(duty)
    assert app.venues.health("v").schedule.next_at <= datetime.now(UTC) + timedelta(minutes=31)
