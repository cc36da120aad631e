import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from threading import Barrier

import pytest
import sqlalchemy as sa

from service.schemas.events.webhooks import Webhook
from service.store import tables
from service.store.blobs import BlobFolderUnavailable
from service.store.jobs.files import source_file
from service.store.jobs.queries import JobPage
from service.store.statistics import counters
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import Stock
from worker.duties.retention import AT_ONCE, FOLDERS_OF_A_JOB, TRY_AGAIN_AFTER, Retention

pytestmark = pytest.mark.slow
NOW = datetime(2026, 11, 21, 10, tzinfo=UTC)


def ago(**time) -> datetime:
    return NOW - timedelta(**time)


@pytest.fixture
def forgotten():
    """What the queue was asked to forget."""
    return []


@pytest.fixture
def retention(stock, forgotten):
    return Retention(stock.settings, stock.expiry, stock.blobs, stock.workers, forgotten.extend)


def failing(call, error, of=""):
    """A call of the store that fails for paths with `of` in them."""

    def fail(path, *others):
        if of in path:
            raise error(path)
        return call(path, *others)

    return fail


@in_both_homes
def test_frames_go_after_two_days_and_pictures_after_two_weeks(stock, retention):
    failed = stock.ended("a", ago(days=3), accepted=None)
    old, older = (stock.ended("a", ago(days=days), accepted=False) for days in (3, 15))
    young = stock.ended("a", ago(days=1))
    retention.round(NOW)
    assert stock.files() == {f"pictures/{old}", f"pictures/{young}", f"frames/{young}"}
    assert {job.id for job in stock.jobs.page(JobPage(10, venue="a")).jobs} == {failed, old, older, young}


@in_one_home_first
def test_frames_of_pictures_that_nobody_has_looked_at_stay_as_long_as_pictures(stock, retention):
    unseen, old = (stock.ended("a", ago(days=days), accepted=False, drawn=False) for days in (3, 15))
    retention.round(NOW)
    assert stock.files() == {f"pictures/{unseen}"}
    folder = stock.jobs.pictures(unseen).folder
    assert stock.blobs.get(source_file(folder, "left")) == b"frame"
    # As after a death between the files and the rows.
    with stock.engine.begin() as connection:
        connection.execute(sa.update(tables.jobs).values(frames_deleted_at=None))
    retention.round(NOW)
    assert stock.blobs.get(source_file(folder, "left")) == b"frame"
    assert stock.jobs.get(old).links.keys() & {"preview"} == set()


def test_frames_that_cannot_be_kept_for_pictures_do_not_go(stock, retention, monkeypatch):
    unseen, later = (stock.ended("a", ago(days=days), accepted=False, drawn=False) for days in (4, 3))
    with monkeypatch.context() as outage:
        outage.setattr(stock.blobs, "move", failing(stock.blobs.move, BlobFolderUnavailable))
        retention.round(NOW)
    assert stock.files() == {f"frames/{unseen}", f"frames/{later}"}
    retention.round(NOW)
    assert stock.files() == {f"pictures/{unseen}", f"pictures/{later}"}


def test_frames_that_cannot_be_kept_for_pictures_hold_up_no_others(stock, retention, monkeypatch):
    stuck, *others = [
        stock.ended("a", ago(days=3, hours=n), accepted=False, drawn=False) for n in range(AT_ONCE + 2, 0, -1)
    ]
    monkeypatch.setattr("worker.duties.retention.BATCH", AT_ONCE + 2)
    monkeypatch.setattr(stock.blobs, "move", failing(stock.blobs.move, BlobFolderUnavailable, of=stuck))
    # A full batch, and so at once a further round.
    assert retention.round(NOW)
    gone = {job for job in (stuck, *others) if f"frames/{job}" not in stock.files()}
    assert gone == set(others)


def test_a_job_with_deleted_pictures_links_to_none(stock, retention):
    job = stock.ended("a", ago(days=15), accepted=False)
    assert "preview" in stock.jobs.get(job).links
    retention.round(NOW)
    assert "preview" not in stock.jobs.get(job).links
    assert stock.jobs.pictures(job).deleted


@in_both_homes
def test_jobs_go_after_400_days_and_the_queue_forgets_them(stock, retention, forgotten):
    job = stock.ended("a", ago(days=401), accepted=False)
    retention.round(NOW)
    assert stock.jobs.get(job) is None
    assert forgotten == [job]
    assert stock.files() == set()


@in_both_homes
def test_the_last_accepted_job_of_each_venue_stays_with_its_pictures(stock, retention):
    before, last = stock.ended("a", ago(days=501)), stock.ended("a", ago(days=500))
    rejected = stock.ended("a", ago(days=499), accepted=False)
    dry = stock.ended("a", ago(days=499), dry_run=True)
    other = stock.ended("b", ago(days=600))
    retention.round(NOW)
    assert [job for job in (before, last, rejected, dry, other) if stock.jobs.get(job)] == [last, other]
    assert stock.files() == {f"pictures/{last}", f"pictures/{other}"}


def test_nothing_of_a_deleted_venue_is_kept_for_ever(stock, retention):
    stock.ended("a", ago(days=500))
    stock.venues.delete("a")
    retention.round(NOW)
    assert (stock.jobs.page(JobPage(10, venue="a")).jobs, stock.files()) == ([], set())


def test_open_jobs_are_never_touched_however_old(stock, retention, forgotten):
    queued, running = stock.submitted("a"), stock.submitted("b")
    stock.attempts.begin(running)
    retention.round(datetime(2099, 1, 1, tzinfo=UTC))
    assert stock.files() == {f"frames/{queued}", f"frames/{running}"}
    assert (stock.jobs.get(queued).status, stock.jobs.get(running).status) == ("queued", "running")
    assert forgotten == []


@in_both_homes
def test_frames_of_an_upload_that_became_no_job_go_after_their_grace(stock, retention):
    grace, submission = timedelta(hours=1), stock.submission("v")
    assert stock.submissions.announce(submission, 100, grace) is None
    stock.blobs.put(f"frames/{submission.job_id}/left/0", b"frame")
    retention.round(stock.expiry.now())
    assert stock.files() == {f"frames/{submission.job_id}"}
    retention.round(stock.expiry.now() + grace)
    assert stock.files() == set()


@in_both_homes
def test_a_round_is_bounded_and_says_that_there_is_more(stock, retention, monkeypatch):
    monkeypatch.setattr("worker.duties.retention.BATCH", 2)
    newest_first = [stock.ended("a", ago(days=3 + n), accepted=None) for n in range(3)]
    assert retention.round(NOW)
    assert stock.files() == {f"frames/{newest_first[0]}"}
    assert not retention.round(NOW)
    assert stock.files() == set()


def test_a_round_that_breaks_off_is_finished_by_the_next(stock, retention, monkeypatch):
    job = stock.ended("a", ago(days=15), accepted=False)
    with monkeypatch.context() as patch:
        patch.setattr(stock.blobs, "delete_under", failing(stock.blobs.delete_under, KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            retention.round(NOW)
    # The row promises nothing any more, and the files are on the list.
    assert stock.jobs.pictures(job).deleted
    assert stock.files() == {f"frames/{job}", f"pictures/{job}"}
    retention.round(NOW)
    assert stock.files() == set()


def test_a_folder_that_cannot_be_deleted_holds_up_no_other(stock, retention, monkeypatch):
    stuck = stock.ended("a", ago(days=4), accepted=None)
    stock.ended("a", ago(days=3), accepted=None)
    with monkeypatch.context() as patch:
        patch.setattr(stock.blobs, "delete_under", failing(stock.blobs.delete_under, PermissionError, of=stuck))
        retention.round(NOW)
    assert stock.files() == {f"frames/{stuck}"}
    retention.round(NOW + timedelta(hours=1))
    assert stock.files() == set()


def test_a_store_that_is_away_holds_up_a_round_for_few_folders(stock, retention, monkeypatch):
    for days in range(AT_ONCE + 3):
        stock.ended("a", ago(days=4 + days), accepted=None)
    asked = []

    def away(folder):
        asked.append(folder)
        raise TimeoutError(folder)

    with monkeypatch.context() as patch:
        patch.setattr(stock.blobs, "delete_under", away)
        assert not retention.round(NOW)
    assert len(asked) == AT_ONCE
    # Those that were not asked for kept their place, those that failed come an hour later.
    retention.round(NOW)
    assert len(stock.files()) == AT_ONCE
    retention.round(NOW + TRY_AGAIN_AFTER)
    assert stock.files() == set()


def test_a_round_deletes_all_that_as_many_jobs_leave_and_many_at_once(stock, retention, monkeypatch):
    batch = 2 * AT_ONCE // FOLDERS_OF_A_JOB
    monkeypatch.setattr("worker.duties.retention.BATCH", batch)
    folders = [f"frames/{stock.ended('a', ago(days=3), accepted=None)}" for _ in range(FOLDERS_OF_A_JOB * batch)]
    stock.expiry.expire_frames([folder.partition("/")[2] for folder in folders], NOW)
    together, delete_under = Barrier(AT_ONCE), stock.blobs.delete_under

    def in_company(folder):
        together.wait(60)
        delete_under(folder)

    monkeypatch.setattr(stock.blobs, "delete_under", in_company)
    assert retention.round(NOW)
    assert stock.files() == set()


@in_both_homes
def test_of_several_workers_one_tidies(stock, retention):
    job = stock.ended("a", ago(days=3), accepted=None)
    stock.workers.register("another", None)
    stock.workers.register("w", None)
    retention.poll()
    assert stock.files() == {f"frames/{job}"}
    stock.workers.forget("another", 0)
    retention.poll()
    assert stock.files() == set()


@in_both_homes
def test_two_rounds_at_once_do_no_harm(stock, retention):
    for days in (3, 15, 401):
        stock.ended("a", ago(days=days), accepted=False)
    # Between looking and writing there is time for the other.
    sa.event.listen(stock.engine, "after_cursor_execute", lambda *_: time.sleep(0.02))
    together = Barrier(2)

    def round_(_):
        together.wait()
        retention.round(NOW)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(round_, range(2)))
    # What one could not delete because the other just did is looked at again.
    retention.round(NOW + TRY_AGAIN_AFTER)
    assert len(stock.files()) == 1
    assert len(stock.jobs.page(JobPage(10, venue="a")).jobs) == 2
    assert stock.expiry.leftovers(NOW + timedelta(days=1), 10) == []


def test_short_of_room_frames_of_ended_jobs_go_at_once_and_nothing_else(stock, retention):
    ended, running = stock.ended("a", ago(minutes=1)), stock.submitted("b")
    stock.attempts.begin(running)
    retention.round(NOW, short_of_room=True)
    assert stock.files() == {f"pictures/{ended}", f"frames/{running}"}


def test_a_full_disk_does_not_wait_for_the_next_round(home, tmp_path, forgotten):
    # A folder of files, wherever the database is.
    here = home.settings(tmp_path) | {"blob_url": (tmp_path / "blobs").as_uri()}
    stock = Stock(tmp_path, min_free_mb=1e12, tidy_every_s=3600, **here)
    retention = Retention(stock.settings, stock.expiry, stock.blobs, stock.workers, forgotten.extend)
    stock.workers.register("w", None)
    retention.poll()
    stock.ended("a", datetime.now(UTC) - timedelta(minutes=1), accepted=None)
    retention.poll()
    assert stock.files() == set()
    stock.engine.dispose()


@in_both_homes
def test_poses_that_calibrations_brought_go_after_years_and_what_people_did_stays(stock, retention):
    for _ in range(4):
        stock.calibrated("a")
    stock.venues.restore("a", 2)
    for _ in range(3):
        stock.calibrated("a")
    stock.calibrated("b")
    in_years(stock, 4.9)
    retention.round(datetime.now(UTC))
    assert numbers(stock, "a") == [9, 8, 7, 6, 5, 4, 3, 2, 1]
    in_years(stock, 0.2)
    retention.round(datetime.now(UTC))
    # Those that hold, those to go back to, what was put and what was put back.
    assert numbers(stock, "a") == [9, 8, 6, 1]
    assert numbers(stock, "b") == [2, 1]
    # Drift goes on from where it was measured, and the last result can still be rejected.
    assert [camera.drift_since for camera in stock.venues.history("a", None, 1)[0].cameras] == [1, 1]
    stock.decisions.reject(stock.venues.history("a", None, 1)[0].job)
    assert [(one.revision, one.restored_from) for one in stock.venues.history("a", None, 1)] == [(10, 8)]


def in_years(stock, years):
    stock.time_passes(days=365.25 * years)


def numbers(stock, venue):
    return [revision.revision for revision in stock.venues.history(venue, None, 100)]


@in_both_homes
def test_callbacks_that_were_not_delivered_expire_by_their_age_however_seldom_they_were_tried(stock, retention):
    url = "https://hangs.example/"
    old, tried, young = (stock.ended("v", ago(days=days), accepted=False, callback_url=url) for days in (2.1, 2.1, 1.9))
    with stock.engine.begin() as connection:
        d = tables.deliveries.c
        last = {"attempts": 3, "last_error": "no answer within 10 s", "due_at": NOW + timedelta(hours=9)}
        connection.execute(sa.update(tables.deliveries).where(d.id == tried).values(last))
    retention.round(NOW)
    told = {job: stock.jobs.get(job).callback for job in (old, tried, young)}
    assert [(told[job].state, told[job].next_attempt_at) for job in (old, tried)] == [("given-up", None)] * 2
    assert told[old].last_error == "its turn did not come in time"
    assert (told[tried].last_error, told[young].state) == ("no answer within 10 s", "waiting")
    with stock.engine.connect() as connection:
        assert counters.read(connection)["callbacks", ("expired",)] == 2


@in_both_homes
def test_deliveries_of_events_expire_in_batches_and_leave_no_row(stock, retention, monkeypatch):
    monkeypatch.setattr("worker.duties.retention.EVENTS", 3)
    hook = Webhook(url="https://hangs.example/told", events=["poses.changed"])
    stock.venues.put(stock.venue("v").model_copy(update={"webhooks": [hook]}))
    for _ in range(4):
        stock.calibrated("v")
    assert stock.callbacks() == {"waiting": 4}
    with stock.engine.begin() as connection:
        connection.execute(sa.update(tables.events).values(at=ago(days=2.5)))
    assert retention.round(NOW)
    assert stock.callbacks() == {"waiting": 1}
    assert not retention.round(NOW)
    assert stock.callbacks() == {}
