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
def home_of_schedules(home, tmp_path, monkeypatch):
    """A home whose queue is short; its cameras show something at once."""
    home.make_database(tmp_path)
    made = ApplicationState(
        Settings(data=tmp_path, queue_limit=LIMIT, sources=["127.0.0.1"], **home.settings(tmp_path))
    )
    monkeypatch.setattr(made.snapshots, "take_of_all", shows)
    yield made
    made.close()
    home.give_back(tmp_path)


@pytest.fixture
def duty(home_of_schedules):
    made = home_of_schedules
    return Scheduler(made.settings, made.schedules, made.venues, made.submissions, made.from_sources, made.disk)


def put(home, name, options=None, alarms=None, source="http://127.0.0.1/x", **more):
    schedule = {"cron": "*/15 * * * *", "options": options} | more
    document = venue(name, cameras=("left",)) | {"schedule": schedule, "alarms": alarms}
    document["cameras"][0]["source"] = source
    home.venues.put(VenueIn.model_validate(document).to_venue())


def all_due(home, minutes=1):
    """Let the times of all schedules have come so many minutes ago."""
    a_while_ago = home.schedules.now() - timedelta(minutes=minutes)
    with home.engine.begin() as connection:
        connection.execute(sa.update(tables.schedules).values(due_at=a_while_ago, look_at=a_while_ago))


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


def waiting(home):
    return home.jobs.page(JobPage(100, status="queued")).jobs


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
        home.from_sources.calibrate(f"other{number}", Options(), None, scheduler.Origin())
    put(home, "v")
    all_due(home)
    monkeypatch.setattr(home.snapshots, "take_of_all", lambda *_: pytest.fail("fetched"))
    look(duty)
    assert home.venues.health("v").schedule.last_error is None


def test_frames_that_are_being_fetched_have_their_place_in_the_queue(home_of_schedules, duty, monkeypatch):
    home, answered = home_of_schedules, threading.Event()
    names = [f"v{number}" for number in range(VENUES)]
    for name in names:
        put(home, name)
    all_due(home)
    monkeypatch.setattr(scheduler, "POLL_S", 0.0)
    monkeypatch.setattr(home.snapshots, "take_of_all", lambda *one, **more: answered.wait(60) and shows(*one, **more))
    duty.poll()
    duty.poll()
    answered.set()
    duty.finish()
    assert len(waiting(home)) == LIMIT
    assert {home.venues.health(name).schedule.last_error for name in names} == {None}


def test_a_venue_that_is_being_calibrated_is_put_off_and_not_forgotten(home_of_schedules, duty):
    home = home_of_schedules
    put(home, "v")
    by_hand, _ = home.from_sources.calibrate("v", Options(seed=3), None, scheduler.Origin())
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
        sooner = home.schedules.now() - DEFER
        connection.execute(sa.update(tables.schedules).where(s.venue == "v").values(look_at=sooner))
    look(duty)
    (job,) = waiting(home)
    assert home.venues.health("v").schedule.last_job == job.id
    assert home.venues.health("v").schedule.last_error is None


def test_a_venue_that_cannot_be_read_says_so_and_fires_again_at_its_next_time(home_of_schedules, duty):
    home = home_of_schedules
    for name in ("broken", "v"):
        put(home, name)
    all_due(home)
    with home.engine.begin() as connection:
        is_broken = tables.venues.c.id == "broken"
        connection.execute(sa.update(tables.venues).where(is_broken).values(document={"id": "broken"}))
    look(duty)
    assert [job.venue for job in waiting(home)] == ["v"]
    state = home.venues.health("broken").schedule
    assert (state.next_at > home.schedules.now(), "cannot be read" in state.last_error) == (True, True)


def test_a_camera_that_gives_no_frame_is_a_job_that_failed(home_of_schedules, duty, monkeypatch):
    home = home_of_schedules
    put(home, "v", alarms={"rejected_in_a_row": 2})
    gone = Problem(
        "source-failed", "No frame of camera left: answered 404.", camera="left", source="http://127.0.0.1/x"
    )

    def take(*_):
        raise gone

    monkeypatch.setattr(home.snapshots, "take_of_all", take)
    for minutes in (3, 2):
        all_due(home, minutes)
        look(duty)
    last, first = home.jobs.page(JobPage(10, venue="v")).jobs
    assert (last.status, last.error.type, last.error.camera) == ("failed", "/problems/source-failed", "left")
    assert last.error.detail == home.venues.health("v").schedule.last_error == gone.detail
    assert home.venues.health("v").schedule.last_job == last.id != first.id
    assert [alarm.rule for alarm in home.venues.health("v").alarms] == ["rejected-in-a-row"]
    assert look_at_figures(home.engine, 1).counters[ENDED, ("failed", "", "source-failed")] == 2
    # There is nothing to compute again, and nothing in the way of the next time.
    assert home.submissions.of(last.id) is None
    assert home.expiry.old_frames(home.schedules.now() + timedelta(days=1), 10) == []
    monkeypatch.setattr(home.snapshots, "take_of_all", shows)
    all_due(home)
    look(duty)
    assert [job.venue for job in waiting(home)] == ["v"]
    assert home.venues.health("v").schedule.last_error is None


@in_both_homes
def test_a_time_that_failed_and_is_fired_again_is_the_same_job(home_of_schedules, duty, monkeypatch):
    home = home_of_schedules
    put(home, "v")
    monkeypatch.setattr(home.snapshots, "take_of_all", lambda *_: fail_with("source-failed"))
    with monkeypatch.context() as patch:
        # The worker dies before it writes down that it is done.
        patch.setattr(home.schedules, "done", lambda *_: 1 / 0)
        all_due(home)
        look(duty)
    with home.engine.begin() as connection:
        connection.execute(sa.update(tables.schedules).values(look_at=tables.schedules.c.due_at))
    look(duty)
    (job,) = home.jobs.page(JobPage(10, venue="v")).jobs
    assert home.venues.health("v").schedule.last_job == job.id


def test_a_schedule_says_how_it_is_to_be_calibrated(home_of_schedules, duty):
    home = home_of_schedules
    put(home, "v", options={"preset": "esc", "priority": "live", "dry_run": True})
    all_due(home)
    look(duty)
    (job,) = waiting(home)
    options = home.submissions.of(job.id).options
    assert (options.priority, options.dry_run) == ("live", True)


def test_a_schedule_may_have_several_frames_of_each_camera_fused(home_of_schedules, duty, monkeypatch):
    home, asked = home_of_schedules, []

    def take(cameras, _, frames, spacing_s, within_s):
        asked.append((frames, spacing_s))
        return {camera.id: [png(shade=shade) for shade in range(frames)] for camera in cameras}

    monkeypatch.setattr(home.snapshots, "take_of_all", take)
    put(home, "v", frames=3, spacing_s=2.5)
    all_due(home)
    look(duty)
    (job,) = waiting(home)
    paths = home.submissions.of(job.id).frames["left"]
    assert [home.blobs.get(path) for path in paths] == [png(shade=shade) for shade in range(3)]
    assert asked == [(3, 2.5)]


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
    assert [firing.venue_id for firing in home.schedules.claim_due(now, now + timedelta(minutes=1), 1)] == ["early"]


def test_a_camera_that_is_slow_holds_up_no_other_venue(home_of_schedules, duty, monkeypatch):
    home, put_through = home_of_schedules, threading.Event()
    for name in ("a-slow", "b"):
        put(home, name)
    all_due(home)

    def take(cameras, *_):
        if cameras[0].source.endswith("slow"):
            assert put_through.wait(60)
        return shows(cameras, *_)

    slow = home.venues.get("a-slow")
    cameras = [camera.model_copy(update={"source": "http://127.0.0.1/slow"}) for camera in slow.cameras]
    home.venues.put(slow.model_copy(update={"cameras": cameras}))
    monkeypatch.setattr(home.snapshots, "take_of_all", take)
    duty.poll()
    # What is being fired is due no earlier than in ten minutes.
    put(home, "c")
    with home.engine.begin() as connection:
        due = sa.update(tables.schedules).where(tables.schedules.c.venue == "c")
        connection.execute(due.values(due_at=home.schedules.now(), look_at=home.schedules.now()))
    poll_until(duty, lambda: "c" in [job.venue for job in waiting(home)])
    put_through.set()
    duty.finish()


def test_venues_whose_cameras_answer_do_not_wait_for_silent_ones(home_of_schedules, duty, monkeypatch):
    home, given_up = home_of_schedules, threading.Event()
    silent = [f"silent-{number}" for number in range(3 * scheduler.AT_ONCE)]
    for name in silent:
        put(home, name, source="http://127.0.0.1/silent")

    def take(cameras, _, frames, spacing_s, within_s):
        if not cameras[0].source.endswith("silent"):
            return shows(cameras, _)
        if within_s is None:
            assert given_up.wait(60)
        raise SourceLate("source-failed", "No frame.", camera="left")

    monkeypatch.setattr(home.snapshots, "take_of_all", take)
    all_due(home, minutes=2)
    # Each is tried once where others wait for it, and from then on where only its like do.
    poll_until(duty, lambda: not look_at_figures(home.engine, 1).schedules_late_s[0])
    put(home, "live")
    with home.engine.begin() as connection:
        now, s = home.schedules.now(), tables.schedules.c
        connection.execute(sa.update(tables.schedules).where(s.venue == "live").values(due_at=now, look_at=now))
    assert [job.venue for job in poll_until(duty, lambda: waiting(home))] == ["live"]
    answered, silent_ones = look_at_figures(home.engine, 1).schedules_late_s
    # Its job waits a moment before its schedule is done.
    assert answered < 30
    assert silent_ones >= 120
    given_up.set()
    poll_until(duty, lambda: not look_at_figures(home.engine, 1).schedules_late_s[1])
    assert sorted(job.venue for job in home.jobs.page(JobPage(100, status="failed")).jobs) == sorted(silent)


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
    """A home with room for the jobs of many venues, and real cameras."""
    made = ApplicationState(Settings(data=tmp_path, sources=["127.0.0.0/8"], source_timeout_s=3))
    yield made
    made.close()


def quick_fetches(home, monkeypatch):
    """The venues' sources that are fetched from in the quick lane, as they are."""
    fetched_from, take = [], home.snapshots.take_of_all

    def noted(cameras, credentials, frames, spacing_s, within_s):
        if within_s is not None:
            fetched_from.append(cameras[0].source)
        return take(cameras, credentials, frames, spacing_s, within_s)

    monkeypatch.setattr(home.snapshots, "take_of_all", noted)
    return fetched_from


def fire_until_a_job_waits(home):
    duty = Scheduler(home.settings, home.schedules, home.venues, home.submissions, home.from_sources, home.disk)
    all_due(home)
    assert [job.venue for job in poll_until(duty, lambda: waiting(home))] == ["z-live"]
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
    home_of_schedules, duty, monkeypatch
):
    home, asked = home_of_schedules, []
    put(home, "v")

    def take(cameras, _, frames, spacing_s, within_s):
        asked.append(within_s)
        if within_s is not None:
            raise SourceLate("source-failed", "No frame.", camera="left")
        return shows(cameras, _)

    monkeypatch.setattr(home.snapshots, "take_of_all", take)
    for minutes in (8, 7):
        all_due(home, minutes)
        look(duty, times=2)
        (job,) = waiting(home)
        home.decisions.cancel(job.id)
    # The first time it was tried quickly, went to the slow lane and was not slow there.
    assert asked == [scheduler.QUICK_S, None] * 2
    monkeypatch.setattr(scheduler, "QUICK_S", -1.0)
    for minutes in (6, 5):
        all_due(home, minutes)
        look(duty, times=2)
        (job,) = waiting(home)
        home.decisions.cancel(job.id)
    # The second time it was known to be slow.
    assert asked[4:] == [-1.0, None, None]


@in_both_homes
def test_schedules_that_a_clock_was_ahead_for_fire_at_their_next_time(home_of_schedules, duty):
    home = home_of_schedules
    for name in ("waits", "claimed"):
        put(home, name)
    look(duty)
    now = home.schedules.now()
    hours = timedelta(hours=6)
    with home.engine.begin() as connection:
        s = tables.schedules.c
        # As a worker left them whose clock was six hours ahead: one waits for its next time, the other was being fired.
        connection.execute(sa.update(tables.schedules).values(due_at=now + hours, look_at=now + hours))
        claimed = {"due_at": now - timedelta(minutes=1), "look_at": now + hours}
        connection.execute(sa.update(tables.schedules).where(s.venue == "claimed").values(**claimed))
    restarted = Scheduler(home.settings, home.schedules, home.venues, home.submissions, home.from_sources, home.disk)
    look(restarted)
    assert [job.venue for job in waiting(home)] == ["claimed"]
    for name in ("waits", "claimed"):
        assert home.venues.health(name).schedule.next_at <= now + timedelta(minutes=31)


@in_both_homes
def test_a_clock_that_is_put_right_while_a_worker_runs_delays_no_schedule(home_of_schedules, duty, monkeypatch):
    home, due = home_of_schedules, home_of_schedules.schedules.due
    put(home, "v")
    hours = timedelta(hours=6)
    with monkeypatch.context() as patch:
        patch.setattr(home.schedules, "now", lambda: datetime.now(UTC) + hours)
        patch.setattr(home.schedules, "due", lambda: replace(due(), now=datetime.now(UTC) + hours, quick=1))
        all_due(home, minutes=0)
        look(duty)
    assert [job.venue for job in waiting(home)] == ["v"]
    assert home.venues.health("v").schedule.next_at > datetime.now(UTC) + hours
    look(duty)
    assert home.venues.health("v").schedule.next_at <= datetime.now(UTC) + timedelta(minutes=31)
