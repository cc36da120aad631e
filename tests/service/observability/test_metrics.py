"""Metrics of jobs, venues and workers, from the database of each home."""

import time
from datetime import timedelta

import pytest
import sqlalchemy as sa

from service.observability.disk import Disk
from service.observability.metrics import Metrics
from service.schemas.job import JobError
from service.schemas.programs.sources import SourceAnswer
from service.schemas.results import View
from service.schemas.schedule import Schedule
from service.store import tables
from service.store.statistics.job_outcome import STAGES
from service.store.statistics.snapshot import read_statistics
from service.store.workers import WorkerRepository
from testbed.homes import in_both_homes
from testbed.stock import Stock, result
from tests.trending import displacement, night

pytestmark = in_both_homes
SILENCE_S = 10


def figures(stock, venues=50):
    """Every sample: its name and its labels, and its value."""
    metrics = Metrics(lambda: read_statistics(stock.engine, venues), Disk(stock.settings), SILENCE_S)
    return {
        (sample.name, *sorted(sample.labels.items())): sample.value
        for family in metrics.registry.collect()
        for sample in family.samples
    }


def ended(found, **labels):
    labels = {"status": "", "verdict": "", "error": ""} | labels
    return found["esc_jobs_ended_total", *sorted(labels.items())]


def failed(stock, kind):
    task = stock.attempts.begin(stock.submitted("v"))
    stock.attempts.fail(task, JobError(type=f"/problems/{kind}", title="", detail=""))


def test_the_ends_of_jobs_are_counted_once_whoever_computed_them(stock, home, tmp_path):
    stock.calibrated("v")
    stock.calibrated("v", accepted=False)
    failed(stock, "job-crashed")
    failed(stock, "no-markings-in-view")
    stock.decisions.cancel(stock.submitted("v"))
    # Another API, or the same after a restart, tells the same.
    other = Stock(tmp_path, **home.settings(tmp_path))
    for found in (figures(stock), figures(other)):
        assert ended(found, status="succeeded", verdict="accepted") == 1
        assert ended(found, status="succeeded", verdict="rejected") == 1
        assert ended(found, status="failed", error="job-crashed") == 1
        assert ended(found, status="failed", error="no-markings-in-view") == 1
        assert ended(found, status="cancelled") == 1
    other.engine.dispose()


def test_how_long_jobs_took_is_a_histogram_of_all_workers(stock):
    for _ in range(2):
        task = stock.attempts.begin(stock.submitted("v"))
        timed = result(task.venue, True).model_copy(update={"timings_s": {"decode": 0.1}})
        stock.attempts.finish(task, timed, [])
    found = figures(stock)
    assert found["esc_job_stage_duration_seconds_count", ("stage", "decode")] == 2
    assert found["esc_job_stage_duration_seconds_sum", ("stage", "decode")] == pytest.approx(0.2)
    below = found["esc_job_stage_duration_seconds_bucket", ("le", "0.1"), ("stage", "decode")]
    assert (below, found["esc_job_wait_seconds_count",], found["esc_job_duration_seconds_count",]) == (2, 2, 2)
    assert found["esc_job_stitch_error_pixels_bucket", ("le", "0.2")] == 2
    assert {dict(key[1:])["stage"] for key in found if key[0] == "esc_job_stage_duration_seconds_count"} == set(STAGES)


def test_a_venue_has_the_stitch_error_of_the_poses_that_hold(stock):
    stock.calibrated("moved")
    stock.calibrated("kept", accepted=False)
    stock.calibrated("tried", dry_run=True)
    found = figures(stock)
    stitch = {
        dict(key[1:])["venue"]: value for key, value in found.items() if key[0] == "esc_venue_stitch_error_pixels"
    }
    assert stitch == {"moved": 0.2, "kept": 10.0, "tried": 10.0}
    accepted = found["esc_venue_accepted_timestamp_seconds", ("venue", "moved")]
    assert time.time() - 60 < accepted <= time.time() + 1
    assert ("esc_venue_accepted_timestamp_seconds", ("venue", "kept")) not in found
    assert found["esc_venue_moved_pixels", ("venue", "kept")] == 1.0
    stock.venues.delete("kept")
    assert ("esc_venue_stitch_error_pixels", ("venue", "kept")) not in figures(stock)


def test_views_are_counted_by_their_condition(stock):
    task = stock.attempts.begin(stock.submitted("v"))
    found = result(task.venue, accepted=False)
    fog = View(usable=False, cause="fogged", detail="Fogged.")
    cameras = [camera.model_copy(update={"view": fog}) for camera in found.cameras]
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
    counted = figures(stock)
    assert counted["esc_views_total", ("condition", "fogged")] == len(cameras)
    assert counted["esc_views_total", ("condition", "usable")] == 0


def test_of_many_venues_only_the_worst_have_figures_of_their_own(stock):
    for name, accepted in (("a", True), ("b", False), ("c", False), ("d", True)):
        stock.calibrated(name, accepted=accepted)
    shown = {dict(key[1:]).get("venue") for key in figures(stock, venues=2)} - {None}
    assert shown == {"b", "c"}


def test_the_queue_is_as_deep_and_as_old_as_it_is(stock):
    for number, priority in enumerate(("live", "routine", "routine")):
        stock.submitted(f"v{number}", priority=priority)
    time.sleep(0.05)
    found = figures(stock)
    assert found["esc_queue_oldest_age_seconds", ("priority", "live")] > 0.04
    assert found["esc_queue_jobs", ("priority", "live")] == 1
    assert found["esc_queue_jobs", ("priority", "routine")] == 2
    assert (found["esc_jobs_running",], found["esc_workers",]) == (0, 0)


def test_each_worker_is_up_until_it_is_silent(stock):
    workers = WorkerRepository(stock.engine)
    for name in ("one", "two"):
        workers.register(name, "f" * 64)
    found = figures(stock)
    assert found["esc_workers",] == 2
    for name in ("one", "two"):
        assert found["esc_worker_up", ("worker", name)] == 1
        assert 0 <= found["esc_worker_heartbeat_age_seconds", ("worker", name)] < SILENCE_S
        assert ("esc_worker_model_info", ("sha256", "f" * 64), ("worker", name)) in found
    with stock.engine.begin() as connection:
        seen_at = tables.workers.c.seen_at
        long_ago = connection.scalar(sa.select(seen_at).limit(1)) - timedelta(seconds=SILENCE_S + 1)
        connection.execute(sa.update(tables.workers).where(tables.workers.c.name == "one").values(seen_at=long_ago))
    found = figures(stock)
    assert (found["esc_worker_up", ("worker", "one")], found["esc_worker_up", ("worker", "two")]) == (0, 1)


def test_an_attempt_after_the_first_is_counted(stock):
    job = stock.submitted("v")
    for _ in range(3):
        task = stock.attempts.begin(job)
    stock.attempts.finish(task, result(task.venue, True), [])
    assert figures(stock)["esc_job_restarts_total",] == 2


def test_each_camera_has_its_trend_from_its_anchor_on(stock):
    night(stock, displacement(0.0))
    found = figures(stock)
    left = (("camera", "left"), ("venue", "v"))
    assert found["esc_camera_trend_meters", *left] == pytest.approx(0.0)
    assert (found["esc_camera_trend_cusum", *left], found["esc_camera_trend_beyond", *left]) == (0, 0)
    # One that somebody has put elsewhere has no trend until its next pose is accepted.
    stock.moved_by_hand("v", -3.0)
    after = figures(stock)
    assert ("esc_camera_trend_meters", *left) not in after
    assert ("esc_camera_trend_meters", ("camera", "right"), ("venue", "v")) in after
    assert len([key for key in figures(stock, venues=0) if key[0].startswith("esc_camera_trend")]) == 0


def test_how_late_schedules_are_and_how_long_sources_took_is_told(stock):
    schedule = Schedule(cron="0 3 * * *")
    for name in ("answers", "silent", "waits"):
        stock.schedule(name, schedule)
    now, s = stock.schedules.now(), tables.schedules.c
    with stock.engine.begin() as connection:
        for name, minutes, failures in (("answers", 2, 0), ("silent", 10, 3)):
            late = {"due_at": now - timedelta(minutes=minutes), "failures": failures}
            connection.execute(sa.update(tables.schedules).where(s.venue == name).values(late))
    stock.source_timings.count(
        [SourceAnswer(camera="c", seconds=seconds, why=why) for seconds, why in ((0.2, None), (0.4, None), (15.0, "x"))]
    )
    found = figures(stock)
    late = "esc_schedule_late_seconds"
    assert 120 <= found[late, ("cameras", "answered")] < 180
    assert 600 <= found[late, ("cameras", "slow-or-silent")] < 660
    took = "esc_source_fetch_seconds"
    assert found[f"{took}_count", ("outcome", "frame")] == 2
    assert found[f"{took}_sum", ("outcome", "none")] == 15
