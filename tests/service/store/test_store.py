import os
import socket
import time
from datetime import timedelta

import obstore
import pytest
import sqlalchemy as sa
from obstore.exceptions import BaseError
from obstore.store import from_url

from service.schemas.addresses import HIDDEN
from service.schemas.geometry import Intrinsics
from service.schemas.health import Alarms as Rules
from service.schemas.job import JobError
from service.schemas.results import View
from service.schemas.source_urls import SourceSecrets
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store import tables
from service.store.blobs import Blobs
from service.store.credentials import read_credentials
from service.store.ids import new_id
from service.store.preconditions import Precondition
from service.store.venues import VenueRepository
from service.store.workers import WorkerRepository
from testbed.homes import in_both_homes, in_one_home_first, on_servers
from testbed.stock import result
from tests.problems import refused


@in_both_homes
def test_a_refused_put_changes_nothing(engine):
    venues = VenueRepository(engine)

    with refused("venue-changed"):
        venues.put(VenueIn.model_validate(VENUE_EXAMPLE).to_venue(), precondition=Precondition('"seen"'))
    assert venues.get("tsukuba") is None


def test_job_ids_sort_by_time():
    ids = [new_id() for _ in range(3)]
    assert all(len(one) == 26 for one in ids)
    assert ids[0][:8] == ids[2][:8]


@in_both_homes
def test_jobs_that_are_not_there_are_none(stock):
    assert stock.jobs.get(new_id()) is None
    assert stock.attempts.begin(new_id()) is None
    assert stock.submissions.of(new_id()) is None
    assert stock.jobs.states([new_id()]) == {}


def test_the_passwords_of_a_venues_sources_go_with_it(stock):
    venue = stock.venue("v")
    left = venue.cameras[0].model_copy(update={"source": "http://***@10.0.0.7/left.jpg"})
    venue = venue.model_copy(update={"cameras": [left, *venue.cameras[1:]]})
    stock.venues.put(venue, {"left": SourceSecrets("user:secret")})
    stock.venues.delete("v")
    with stock.engine.connect() as connection:
        assert read_credentials(connection, "v") == {}
    with refused("source-refused"):
        stock.venues.put(venue, {"left": SourceSecrets(HIDDEN)})


@in_both_homes
def test_a_silent_worker_is_noticed_and_may_come_back(engine):
    workers = WorkerRepository(engine)
    workers.register("w", None)
    assert [worker.name for worker in workers.alive(5)] == ["w"]
    assert workers.beat_and_listen("nobody", None, 0).silent_workers == ["w"]
    workers.forget("w", 5)
    assert workers.beat("w")
    workers.forget("w", 0)
    assert not workers.beat("w")


@in_both_homes
def test_a_worker_that_died_before_its_clock_was_put_right_is_noticed_as_soon_as_any(engine):
    workers = WorkerRepository(engine)
    for name in ("dead", "alive"):
        workers.register(name, None)
    with engine.begin() as connection:
        ahead = workers.now() + timedelta(hours=6)
        connection.execute(sa.update(tables.workers).where(tables.workers.c.name == "dead").values(seen_at=ahead))
    # Nobody knows: it may only not have given a sign of life since.
    assert [worker.name for worker in workers.alive(10)] == ["alive"]
    assert workers.beat_and_listen("nobody", None, 10).silent_workers == []
    workers.beat("alive")
    time.sleep(0.1)
    assert workers.beat_and_listen("nobody", None, 0.05).silent_workers == ["alive", "dead"]


@in_both_homes
def test_blobs_are_kept_and_removed_by_folder(home, tmp_path):
    blobs = Blobs(home.blob_url(tmp_path / "a folder"))
    blobs.put("frames/a/left/0", b"1")
    blobs.put("frames/ab/left/0", b"2")
    blobs.delete_under("frames/a")
    assert blobs.get("frames/a/left/0") is None
    assert blobs.get("frames/ab/left/0") == b"2"
    blobs.check()


def test_what_a_killed_process_left_of_a_blob_goes_with_its_folder(tmp_path):
    blobs = Blobs((tmp_path / "blobs").as_uri())
    blobs.put("frames/a/left/0", b"1")
    # Written under this name until it is whole; the store's own list does not show it.
    (tmp_path / "blobs/frames/a/left/1#1").write_bytes(b"half")
    blobs.delete_under("frames/a")
    assert not (tmp_path / "blobs/frames/a").exists()
    blobs.delete_under("frames/a")


@on_servers
def test_a_large_blob_goes_to_a_bucket_in_one_piece(home, tmp_path):
    # In several, those of a killed process would lie there for ever and be paid for.
    url = home.blob_url(tmp_path)
    Blobs(url).put("frames/a/left/0", bytes(20_000_000))
    assert "-" not in obstore.head(from_url(url), "frames/a/left/0")["e_tag"]


@on_servers
def test_the_credentials_of_a_bucket_may_stand_in_files(home, tmp_path, monkeypatch):
    url = home.blob_url(tmp_path)
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        (tmp_path / name).write_text(f"{os.environ[name]}\n")
        monkeypatch.setenv(f"{name}_FILE", str(tmp_path / name))
        monkeypatch.delenv(name)
    blobs = Blobs(url, patience_s=5)
    blobs.put("frames/a/left/0", b"1")
    assert blobs.get("frames/a/left/0") == b"1"


def test_a_blob_reaches_the_disk_with_every_folder_on_the_way_to_it(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr("service.store.blobs._sync", synced.append)
    Blobs((tmp_path / "blobs").as_uri()).put("frames/a/left/0", b"1")
    ways = ("frames/a/left/0", "frames/a/left", "frames/a", "frames", "")
    assert synced == [tmp_path / "blobs" / way for way in ways]


def gives_up_in_time(monkeypatch, address):
    """Whether a bucket at an address is asked for about as long as a patience of a second allows."""
    settings = {"ENDPOINT_URL": address, "ALLOW_HTTP": "true", "ACCESS_KEY_ID": "k", "SECRET_ACCESS_KEY": "s"}
    for name, value in settings.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    begun = time.monotonic()
    with pytest.raises(BaseError):
        Blobs("s3://bucket", patience_s=1).put("frames/a/left/0", b"1")
    return 1 < time.monotonic() - begun < 20


def test_a_bucket_that_does_not_answer_is_asked_for_as_long_as_its_caller_is_patient(monkeypatch):
    assert gives_up_in_time(monkeypatch, "http://127.0.0.1:1")


def writes_all_it_can(stock, task):
    """A worker that does not know yet that its attempt is over."""
    stock.attempts.finish(task, result(task.venue, True), [])
    stock.attempts.fail(task, JobError(type="/problems/job-crashed", title="", detail=""))
    assert not stock.attempts.hand_back(task)


@in_both_homes
def test_a_job_that_was_cancelled_stays_so_whatever_its_worker_still_writes(stock):
    task = stock.attempts.begin(stock.submitted("v"))
    stock.decisions.cancel(task.job_id)
    before = stock.venues.get("v")
    writes_all_it_can(stock, task)
    job = stock.jobs.get(task.job_id)
    assert (job.status, job.result, job.error) == ("cancelled", None, None)
    assert stock.venues.get("v") == before


@in_both_homes
def test_a_job_that_was_given_to_another_worker_is_that_ones_whatever_the_first_still_writes(stock):
    job_id = stock.submitted("v")
    first, other = stock.attempts.begin(job_id), stock.attempts.begin(job_id)
    before = stock.venues.get("v")
    writes_all_it_can(stock, first)
    job = stock.jobs.get(job_id)
    assert (job.status, job.attempt, job.result, job.error) == ("running", 2, None, None)
    assert stock.venues.get("v") == before
    stock.attempts.finish(other, result(other.venue, True), [])
    assert stock.jobs.get(job_id).status == "succeeded"


def test_a_job_is_handed_out_with_the_lenses_that_its_poses_belong_to(stock):
    job_id = stock.submitted("v")
    assert stock.jobs.posed(job_id) is None
    task = stock.attempts.begin(job_id)
    left, right = task.venue.cameras
    longer = Intrinsics(matrix=[[61, 0, 32], [0, 61, 24], [0, 0, 1]], distortion=[])
    found = result(task.venue, False)
    cameras = [found.cameras[0].model_copy(update={"intrinsics": longer}), *found.cameras[1:]]
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
    posed = stock.jobs.posed(job_id)
    assert [camera.intrinsics for camera in posed.cameras] == [longer, right.intrinsics]
    assert posed.cameras[0].pose == cameras[0].pose
    assert stock.venues.get("v").cameras[0] == left


def test_a_bucket_that_takes_a_request_and_says_nothing_is_not_waited_for_any_longer(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        assert gives_up_in_time(monkeypatch, "http://{}:{}".format(*silent.getsockname()))


@in_one_home_first
def test_a_job_is_handed_out_with_what_the_frames_of_the_last_accepted_one_were_like(stock):
    def after(task, view, *, accepted):
        """The next job, when this one has ended with such a view of all cameras."""
        found = result(task.venue, accepted)
        cameras = [camera.model_copy(update={"view": view}) for camera in found.cameras]
        stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
        return stock.attempts.begin(stock.submitted("v"))

    clear = View(usable=True, detail="The field can be seen.", lines_found=0.9, blur_px=0.8)
    fog = View(usable=False, cause="fogged", detail="Fogged.", lines_found=0.1)
    first = stock.attempts.begin(stock.submitted("v"))
    assert first.last_views == {}
    second = after(first, clear, accepted=True)
    assert second.last_views == {camera.id: clear for camera in first.venue.cameras}
    assert after(second, fog, accepted=False).last_views == second.last_views


@in_both_homes
def test_the_end_of_a_job_reads_and_writes_what_is_known_of_its_venue_once(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Rules(moved_since_last_px=0.001)}))
    stock.calibrated("v")
    task, statements = stock.attempts.begin(stock.submitted("v")), []

    @sa.event.listens_for(stock.engine, "before_cursor_execute")
    def note(_, __, statement, *___):
        statements.append(statement)

    stock.attempts.finish(task, result(task.venue, True), [])
    of_venue = [statement.split()[0] for statement in statements if "venue_quality" in statement]
    assert of_venue == ["SELECT", "UPDATE"]
    reads = [statement.replace("\n", " ") for statement in statements if statement.startswith("SELECT")]
    for table in ("venues", "camera_anchors"):
        assert len([statement for statement in reads if f"FROM {table} " in statement]) == 1
    assert len([statement for statement in reads if "FROM revisions " in statement and "LIMIT" in statement]) == 1
    # 36 and, with what PostgreSQL is asked for the time and for locks, 42 when each part of the end read for itself.
    assert len(statements) <= 24
