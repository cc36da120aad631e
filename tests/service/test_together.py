"""What several processes do to one home at the same moment."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from threading import Barrier, Thread

import pytest

from service.queue import Queue
from service.queue import migrate as migrate_queue
from service.store import jobs as store
from service.store.engine import connect, migrate
from service.store.ids import new_id
from service.store.jobs import Jobs, QueueFull, Submission
from service.store.venues import Venues
from service.store.workers import Workers
from service.wire.geometry import Moved, Pose
from service.wire.job import JobError
from service.wire.options import Options
from service.wire.results import CameraResult, Provenance, Result
from service.wire.venue import VenueIn
from tests.e2e.running import venue
from tests.homes import in_both_homes
from tests.worker.stock import Stock

LIMIT = 3
SHIFTED = [0.0, -55.0, 9.0]


def stored(name):
    return VenueIn.model_validate(venue(name, cameras=("left",))).stored()


def submission(name, content="c"):
    return Submission(new_id(), stored(name), Options(seed=1), content, None, {"left": ["frames/x/left/0"]})


def found():
    moved = CameraResult(
        id="left",
        pose=Pose.at([1.6, 0.1, -0.2], SHIFTED),
        sigma=None,
        moved=Moved(rotation_deg=0, position_m=1, pixels=None),
        iou=0.9,
        residual_px=None,
    )
    return Result(
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
def running(engine):
    """A job that a worker has begun."""
    Venues(engine).put(stored("v"), lambda _: None)
    job, _ = Jobs(engine).submit(submission("v"), LIMIT, lambda *_: None)
    return Jobs(engine).begin(job.id)


@in_both_homes
def test_processes_that_start_together_make_the_schema_once(home, tmp_path):
    engines = [connect(home.database_url(tmp_path)) for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(migrate, engines))
    assert Workers(engines[0]).silent(0) == []
    for engine in engines:
        engine.dispose()


@in_both_homes
def test_the_queue_takes_no_more_than_its_limit_however_many_come_at_once(engine, queue):
    jobs, crowd = Jobs(engine), 8
    for number in range(crowd):
        Venues(engine).put(stored(f"v{number}"), lambda _: None)
    together = Barrier(crowd)

    def submit(number):
        together.wait()
        try:
            return jobs.submit(submission(f"v{number}"), LIMIT, queue.enqueue)[1]
        except QueueFull:
            return False

    with ThreadPoolExecutor(crowd) as pool:
        assert sum(pool.map(submit, range(crowd))) == LIMIT
    assert [job.status for job in jobs.page(None, None, None, 100)] == ["queued"] * LIMIT


@in_both_homes
@pytest.mark.parametrize("other", ["cancel", "begin", "fail"])
def test_the_poses_move_only_with_the_job_that_ends_with_them(engine, running, monkeypatch, other):
    jobs, venues = Jobs(engine), Venues(engine)
    meddle = {
        "cancel": lambda: jobs.cancel(running.job_id),
        "begin": lambda: jobs.begin(running.job_id),
        "fail": lambda: jobs.fail(running, JobError(type="/problems/job-crashed", title="", detail="")),
    }
    meddler = Thread(target=meddle[other])
    find_venue = store.find_venue

    def find_venue_slowly(*arguments):
        # Who meddles may look for the venue too.
        if meddler.ident is None:
            meddler.start()
            meddler.join(0.5)
        return find_venue(*arguments)

    monkeypatch.setattr(store, "find_venue", find_venue_slowly)
    jobs.finish(running, found(), [])
    meddler.join()
    moved = venues.get("v").cameras[0].pose.position == SHIFTED
    assert (jobs.get(running.job_id).status, moved) == ("succeeded", True)


def test_what_a_job_says_of_its_times_is_no_matter_of_a_machines_clock(servers, tmp_path, monkeypatch):
    stock = Stock(tmp_path, **servers.settings(tmp_path))
    wrong = type("Wrong", (datetime,), {"now": lambda zone: datetime.now(zone) + timedelta(days=3)})
    with monkeypatch.context() as patch:
        patch.setattr("service.store.engine.datetime", wrong)
        job = stock.jobs.get(stock.submitted("v", callback_url="https://example.com/"))
        stock.jobs.cancel(job.id)
        stock.expiry.expect_upload("01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", timedelta(hours=1))
        assert stock.expiry.leftovers(stock.expiry.now(), 10) == []
        assert stock.deliveries.attempt(stock.deliveries.now(), stock.deliveries.now(), 10)
        assert stock.expiry.expire_frames(stock.expiry.now() - timedelta(days=2), stock.expiry.now(), 10) == 0
    now, ended = datetime.now(UTC), stock.jobs.get(job.id)
    for moment in (job.created_at, ended.finished_at, stock.expiry.now(), stock.deliveries.now()):
        assert abs(now - moment) < timedelta(minutes=10)
    stock.engine.dispose()


def test_workers_are_not_dead_because_the_clock_of_their_machine_is_wrong(servers, tmp_path, monkeypatch):
    engine = connect(servers.database_url(tmp_path))
    migrate(engine)
    late = type("Late", (datetime,), {"now": lambda zone: datetime.now(zone) - timedelta(hours=1)})
    with monkeypatch.context() as patch:
        patch.setattr("service.store.engine.datetime", late)
        Workers(engine).enter("w", None)
    assert Workers(engine).silent(10) == []
    engine.dispose()
