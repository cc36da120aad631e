"""What several processes do to one home at the same moment."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from datetime import UTC, datetime, timedelta
from threading import Barrier, BrokenBarrierError, Thread, Timer

import pytest

from service.queue import Queue
from service.queue import migrate as migrate_queue
from service.schemas.geometry import Moved, Pose
from service.schemas.health import Alarms as Rules
from service.schemas.job import JobError
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.results import CameraResult, Provenance, Result
from service.schemas.venue import VenueIn
from service.store.database import connect, migrate
from service.store.ids import new_id
from service.store.jobs import ending
from service.store.jobs import submission as submissions
from service.store.jobs.queries import JobPage
from service.store.jobs.submission import Submission
from service.store.statistics import counters
from service.store.workers import WorkerRepository
from testbed.homes import in_both_homes, on_servers
from testbed.running import venue
from testbed.stock import result
from tests.problems import refused

LIMIT = 3
SHIFTED = [0.0, -55.0, 9.0]


def stored(name):
    return VenueIn.model_validate(venue(name, cameras=("left",))).to_venue()


def submission(name, content="c"):
    return Submission(
        job_id=new_id(),
        venue=stored(name),
        options=Options(seed=1),
        frames={"left": ["frames/x/left/0"]},
        content_hash=content,
        idempotency_key=None,
    )


def found():
    moved = CameraResult(
        id="left",
        accepted=True,
        rejected_because=None,
        pose=Pose.from_position([1.6, 0.1, -0.2], SHIFTED),
        sigma=None,
        moved=Moved(rotation_deg=0, position_m=1, pixels=None),
        iou=0.9,
        residual_px=None,
    )
    return Result(
        verdict="accepted",
        accepted=True,
        rejected_because=None,
        cameras=[moved],
        stitch_error_px=None,
        stitch_error_before_px=None,
        loss=0.1,
        generations=1,
        timings_s={},
        provenance=Provenance(software="0", model_sha256="0", seed=1, options={}),
    )


@pytest.fixture
def queue(home, tmp_path, engine):
    migrate_queue(home.database_url(tmp_path))
    queue = Queue(home.database_url(tmp_path))
    yield queue
    queue.close()


@pytest.fixture
def running(stock):
    """A job that a worker has begun."""
    return stock.attempts.begin(stock.submitted("v"))


@in_both_homes
def test_processes_that_start_together_make_the_schema_once(home, tmp_path):
    engines = [connect(home.database_url(tmp_path)) for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(migrate, engines))
    assert WorkerRepository(engines[0]).beat_and_listen("nobody", None, 0).silent_workers == []
    for engine in engines:
        engine.dispose()


def test_a_process_that_starts_waits_for_one_that_writes_to_the_new_file(tmp_path):
    file = tmp_path / "esc.sqlite"
    with closing(sqlite3.connect(file, isolation_level=None, check_same_thread=False)) as writer:
        writer.execute("BEGIN IMMEDIATE")
        end = Timer(0.2, writer.execute, ["COMMIT"])
        end.start()
        engine = connect(f"sqlite:///{file}")
        with engine.connect() as connection:
            assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
        end.join()
    engine.dispose()


@in_both_homes
def test_the_queue_takes_no_more_than_its_limit_however_many_come_at_once(stock, queue):
    crowd = 8
    for number in range(crowd):
        stock.venues.put(stored(f"v{number}"))
    together = Barrier(crowd)

    def submit(number):
        together.wait()
        try:
            return stock.submissions.submit(submission(f"v{number}"), LIMIT, queue.enqueue)[1]
        except Problem:
            return False

    with ThreadPoolExecutor(crowd) as pool:
        assert sum(pool.map(submit, range(crowd))) == LIMIT
    assert [job.status for job in stock.jobs.page(JobPage(100)).jobs] == ["queued"] * LIMIT


@on_servers
def test_other_content_under_a_key_whose_job_comes_meanwhile_is_told_that_and_not_that_the_venue_is_busy(
    stock, queue, monkeypatch
):
    stock.venues.put(stored("v"))
    first, other = (submission("v", content).model_copy(update={"idempotency_key": "k"}) for content in ("c", "d"))
    look_up = submissions._of_key

    def looked_up_just_before(*arguments):
        monkeypatch.setattr(submissions, "_of_key", look_up)
        before = look_up(*arguments)
        stock.submissions.submit(first, LIMIT, queue.enqueue)
        return before

    monkeypatch.setattr(submissions, "_of_key", looked_up_just_before)
    with refused("idempotency-key-reused") as problem:
        stock.submissions.announce(other, LIMIT, timedelta(minutes=1))
    assert problem.value.parts["job"] == first.job_id


@in_both_homes
@pytest.mark.parametrize("other", ["cancel", "begin", "fail"])
def test_the_poses_move_only_with_the_job_that_ends_with_them(stock, running, monkeypatch, other):
    meddle = {
        "cancel": lambda: stock.decisions.cancel(running.job_id),
        "begin": lambda: stock.attempts.begin(running.job_id),
        "fail": lambda: stock.attempts.fail(running, JobError(type="/problems/job-crashed", title="", detail="")),
    }
    meddler = Thread(target=meddle[other])
    fold = ending.fold

    def fold_slowly(*arguments):
        # Who meddles may end the job too.
        if meddler.ident is None:
            meddler.start()
            meddler.join(0.5)
        return fold(*arguments)

    monkeypatch.setattr(ending, "fold", fold_slowly)
    stock.attempts.finish(running, found(), [])
    meddler.join()
    moved = stock.venues.get("v").cameras[0].pose.position == SHIFTED
    assert (stock.jobs.get(running.job_id).status, moved) == ("succeeded", True)


@on_servers
def test_what_a_job_says_of_its_times_is_no_matter_of_a_machines_clock(stock, monkeypatch):
    wrong = type("Wrong", (datetime,), {"now": lambda zone: datetime.now(zone) + timedelta(days=3)})
    with monkeypatch.context() as patch:
        patch.setattr("service.store.database.datetime", wrong)
        job = stock.jobs.get(stock.submitted("v", callback_url="https://example.com/"))
        stock.decisions.cancel(job.id)
        assert stock.submissions.announce(stock.submission("w"), 100, timedelta(hours=1)) is None
        assert stock.expiry.leftovers(stock.expiry.now(), 10) == []
        assert stock.outbox.claim_due(stock.outbox.now(), stock.outbox.now(), 10)
        assert stock.expiry.old_frames(stock.expiry.now() - timedelta(days=2), 10) == []
    now, ended = datetime.now(UTC), stock.jobs.get(job.id)
    for moment in (job.created_at, ended.finished_at, stock.expiry.now(), stock.outbox.now()):
        assert abs(now - moment) < timedelta(minutes=10)


@on_servers
def test_workers_are_not_dead_because_the_clock_of_their_machine_is_wrong(engine, monkeypatch):
    late = type("Late", (datetime,), {"now": lambda zone: datetime.now(zone) - timedelta(hours=1)})
    with monkeypatch.context() as patch:
        patch.setattr("service.store.database.datetime", late)
        WorkerRepository(engine).register("w", None)
    assert WorkerRepository(engine).beat_and_listen("nobody", None, 10).silent_workers == []


def two_count_at_once(monkeypatch):
    """Each of two transactions has counted something before either goes on."""
    add, counted = counters.add, Barrier(2)

    def add_slowly(connection, amounts):
        add(connection, amounts)
        with suppress(BrokenBarrierError):
            counted.wait(1)

    monkeypatch.setattr(counters, "add", add_slowly)


@on_servers
def test_a_job_that_is_rejected_and_one_that_fails_do_not_wait_for_each_other(stock, monkeypatch):
    for name in ("v", "w"):
        rules = Rules(rejected_in_a_row=1)
        stock.venues.put(stored(name).model_copy(update={"alarms": rules}))
    rejected, failed = (stock.attempts.begin(stock.submitted(name)) for name in ("v", "w"))
    # Both count an alarm and an end; each has counted one of them before either counts the other.
    two_count_at_once(monkeypatch)
    error = JobError(type="/problems/job-crashed", title="", detail="")
    with ThreadPoolExecutor(2) as both:
        ends = [
            both.submit(stock.attempts.finish, rejected, result(rejected.venue, False), []),
            both.submit(stock.attempts.fail, failed, error),
        ]
    assert [end.exception() for end in ends] == [None, None]
    assert [stock.jobs.get(task.job_id).status for task in (rejected, failed)] == ["succeeded", "failed"]


@on_servers
def test_alarms_that_begin_in_another_order_at_another_venue_do_not_wait_for_each_other(stock, monkeypatch):
    moved_at_once(stock, "v", {"left": 1.0, "right": 0.0})
    # The camera that comes first has drifted for longer, the second one has moved just now.
    moved_at_once(stock, "w", {"left": 1.0, "right": 0.0}, {"left": 0.001, "right": 0.3})
    left, right = stock.venues.health("w").cameras
    rules = Rules(
        moved_since_last_px=right.moved.pixels / 2, moved_since_first_px=(left.drift.pixels + right.drift.pixels) / 2
    )
    two_count_at_once(monkeypatch)
    watched = [stock.venues.get(name).model_copy(update={"alarms": rules}) for name in ("v", "w")]
    with ThreadPoolExecutor(2) as both:
        puts = [both.submit(stock.venues.put, venue) for venue in watched]
    assert [put.exception() for put in puts] == [None, None]
    ringing = {name: {(alarm.rule, alarm.camera) for alarm in stock.venues.health(name).alarms} for name in ("v", "w")}
    assert ringing == {
        "v": {("moved-since-last", "left"), ("moved-since-first", "left")},
        "w": {("moved-since-first", "left"), ("moved-since-last", "right")},
    }


def moved_at_once(stock, name, *jobs):
    """Calibrations of a venue that each move its cameras along the pitch by so many metres."""
    for metres in jobs:
        task = stock.attempts.begin(stock.submitted(name))
        said = result(task.venue, True)
        cameras = [
            camera.model_copy(update={"pose": Pose.from_position(camera.pose.rotation, [x + metres[camera.id], y, z])})
            for camera, (x, y, z) in (
                (camera, stood.pose.position) for camera, stood in zip(said.cameras, task.venue.cameras, strict=True)
            )
        ]
        stock.attempts.finish(task, said.model_copy(update={"cameras": cameras}), [])
