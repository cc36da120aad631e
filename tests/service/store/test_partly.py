"""A calibration that is accepted of some cameras only: what is stored, counted, told and undone."""

import pytest

from service.schemas.geometry import Light
from service.schemas.results import View
from service.store.statistics.snapshot import read_statistics
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import result
from tests.service.store.test_alarms import failed, rings, told, watched


def standing(stock):
    """Where each camera stands along the pitch."""
    return {camera.id: round(camera.pose.position[0], 6) for camera in stock.venues.get("v").cameras}


def partly(stock, **options):
    """A calibration of which only the left camera is accepted; each is found a millimetre from where it stands."""
    return stock.calibrated("v", accepted=["left"], **options)


BEFORE, LEFT_MOVED, BOTH_MOVED = (
    {"left": -1.0, "right": -1.0},
    {"left": -0.999, "right": -1.0},
    {"left": -0.999, "right": -0.999},
)


@in_one_home_first
def test_only_the_poses_that_are_accepted_are_stored(stock):
    stock.venue("v")
    assert standing(stock) == BEFORE
    job = partly(stock)
    assert standing(stock) == LEFT_MOVED
    newest = stock.venues.history("v", None, 1)[0]
    assert (newest.revision, newest.cause, newest.job) == (2, "calibrated", job)
    left, right = newest.cameras
    assert (left.moved.position_m, right.moved.position_m) == (pytest.approx(0.001), 0.0)
    assert stock.jobs.get(job).venue_revision == 2
    assert stock.jobs.get(job).result.verdict == "partly"


# By hand


def test_one_camera_after_the_other_can_be_taken_by_hand(stock):
    stock.venue("v")
    job = stock.calibrated("v", accepted=False)
    stock.decisions.accept(job, ["left"])
    assert standing(stock) == LEFT_MOVED
    stock.decisions.accept(job, ["left"])
    stock.decisions.accept(job, ["right"])
    assert standing(stock) == BOTH_MOVED
    assert [one.revision for one in stock.venues.history("v", None, 9)] == [3, 2, 1]


def test_to_give_a_job_back_gives_back_what_was_taken_of_it_by_hand_as_well(stock):
    stock.venue("v")
    job = partly(stock)
    stock.decisions.accept(job)
    assert standing(stock) == BOTH_MOVED
    for _ in range(2):
        stock.decisions.reject(job)
    assert standing(stock) == BEFORE
    newest = stock.venues.history("v", None, 1)[0]
    assert (newest.cause, newest.job, newest.restored_from) == ("restored", job, 1)
    stock.decisions.accept(job, ["right"])
    assert standing(stock) == {"left": -1.0, "right": -0.999}


# What is told


def test_health_tells_of_each_camera_when_it_was_accepted_and_how_often_not_since(stock):
    stock.venue("v")
    partly(stock)
    partly(stock)
    failed(stock)
    health = stock.venues.health("v")
    left, right = health.cameras
    assert (left.rejected_in_a_row, right.rejected_in_a_row, health.rejected_in_a_row) == (1, 3, 1)
    assert (left.accepted_at, right.accepted_at) == (health.accepted_at, None)
    stock.calibrated("v")
    assert [camera.rejected_in_a_row for camera in stock.venues.health("v").cameras] == [0, 0]


def test_a_camera_that_is_rejected_again_and_again_rings_by_itself(stock):
    watched(stock, rejected_in_a_row=2)
    partly(stock)
    assert rings(stock) == []
    job = partly(stock)
    assert rings(stock) == [("rejected-in-a-row", "right")]
    assert stock.venues.health("v").alarms[0].why == "The last 2 calibrations brought no pose of camera right."
    stock.decisions.accept(job)
    assert rings(stock) == []
    assert told(stock) == [("rejected-in-a-row", "began"), ("rejected-in-a-row", "ended")]


def test_a_camera_whose_pose_is_old_rings_by_itself_until_it_is_accepted(stock):
    watched(stock, not_calibrated_for_h=24)
    stock.time_passes(hours=23)
    partly(stock)
    assert rings(stock) == []
    stock.time_passes(hours=2)
    stock.venues.update_alarms("v")
    assert rings(stock) == [("not-calibrated", "right")]
    assert stock.venues.health("v").alarms[0].why.startswith("No pose of camera right was accepted since ")
    stock.calibrated("v")
    assert rings(stock) == []


@in_both_homes
def test_it_is_a_verdict_of_its_own_where_jobs_are_counted_and_listed(stock):
    stock.venue("v")
    partly(stock)
    (end,) = stock.past_calibrations.of("v", 1)
    assert (end.verdict, end.accepted, end.rejected_because) == ("partly", False, "the lines do not fit")
    assert read_statistics(stock.engine, 10).counters["jobs_ended", ("succeeded", "partly", "")] == 1


def test_what_a_camera_usually_shows_is_what_it_showed_when_it_was_accepted(stock):
    stock.venue("v")
    calibrated(stock, True, view=View(usable=True, detail="", lines_found=0.9))
    calibrated(stock, ["left"], view=View(usable=True, detail="", lines_found=0.5))
    views = stock.attempts.begin(stock.submitted("v")).last_views
    assert {camera: view.lines_found for camera, view in views.items()} == {"left": 0.5, "right": 0.9}


def test_the_light_of_a_camera_is_kept_with_its_pose_and_until_another_is_found(stock):
    light = Light(gain=[1.1, 1.0, 0.9], contrast=0.05, falloff=0.1)
    stock.venue("v")
    calibrated(stock, ["left"], light=light)
    calibrated(stock, True)
    assert {camera.id: camera.light for camera in stock.venues.get("v").cameras} == {"left": light, "right": None}


def calibrated(stock, accepted, **told):
    """A calibration that says this of each camera."""
    task = stock.attempts.begin(stock.submitted("v"))
    found = result(task.venue, accepted)
    cameras = [camera.model_copy(update=told) for camera in found.cameras]
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
