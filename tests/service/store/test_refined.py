"""Refined poses and lenses in the results of jobs: to whom they belong, and how they are stored."""

import sqlalchemy as sa

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.results import Refined
from service.store import tables
from service.store.memories import newest_memories
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import result
from tests.problems import refused

LENS = Intrinsics(matrix=[[60.06, 0, 32], [0, 60.06, 24], [0, 0, 1]], distortion=[0, 0, 0, 0], sigma={"fx": 0.01})


def night(stock, accepted=True, **options):
    """A job whose cameras have refined poses, a centimetre above those that it answers; gives its id."""
    task = stock.attempts.begin(stock.submitted("v", **options))
    found = result(task.venue, accepted)
    cameras = [camera.model_copy(update={"refined": refined(camera.pose)}) for camera in found.cameras]
    memories = {camera.id: {"jobs": 1} for camera in cameras}
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [], memories)
    return task.job_id


def refined(pose):
    x, y, z = pose.position
    there = Pose.from_position(pose.rotation, [x, y, z + 0.01])
    return Refined(pose=there, intrinsics=LENS, covariance=None, sigma=None, longer=0.001, differs_m=0.03)


def along(stock):
    """Where along the pitch the refined poses of the venue are, by camera."""
    found = stock.adoption.refined_of_venue(stock.venues.get("v"))
    return {camera: round(one.pose.position[0], 6) for camera, one in found.items()}


@in_both_homes
def test_each_camera_has_that_of_the_last_job_that_moved_it(stock):
    stock.venue("v")
    assert along(stock) == {}
    night(stock)
    night(stock, accepted=["left"])
    night(stock, accepted=False)
    night(stock, dry_run=True)
    assert along(stock) == {"left": -0.998, "right": -0.999}
    # The newest night of a release without them says that there is none.
    stock.calibrated("v")
    assert along(stock) == {}


def test_a_restored_pose_has_that_of_its_own_job(stock):
    stock.venue("v")
    night(stock)
    night(stock)
    stock.venues.restore("v", 2)
    assert along(stock) == {"left": -0.999, "right": -0.999}
    stock.venues.restore("v", 1)
    assert along(stock) == {}


def test_a_camera_that_was_put_since_has_none_and_on_another_field_nobody_has(stock):
    stock.venue("v")
    night(stock)
    stock.moved_by_hand("v", -3.0)
    assert along(stock) == {"right": -0.999}
    other = stock.venue("v").model_copy(update={"field": FieldOfPlay(length_m=104, width_m=68)})
    stock.venues.put(other)
    assert along(stock) == {}


def test_a_refused_pose_that_is_accepted_by_hand_has_none(stock):
    stock.venue("v")
    stock.decisions.accept(night(stock, accepted=["right"]))
    assert along(stock) == {"right": -0.999}


@in_one_home_first
def test_to_store_one_is_a_revision_that_keeps_the_memories_and_what_is_known_of_the_lens(stock):
    stock.venue("v")
    job = night(stock)
    adopted = stock.adoption.adopt_refined("v", "left")
    assert adopted == stock.venues.get("v")
    left, right = adopted.cameras
    assert (left.pose.position[2], left.intrinsics) == (8.01, LENS.model_copy(update={"sigma": None}))
    assert (right.pose.position[2], right.intrinsics.matrix[0][0]) == (8.0, 60)
    newest = stock.venues.history("v", None, 1)[0]
    assert (newest.revision, newest.cause, newest.job) == (3, "adopted", job)
    # It was found there, and put nowhere: drift is counted from where it was put.
    assert [camera.drift_since for camera in newest.cameras] == [1, 1]
    with stock.engine.connect() as connection:
        assert newest_memories(connection, "v") == {"left": {"jobs": 1}, "right": {"jobs": 1}}
    # It is still that of the job, and to store it again changes nothing.
    assert stock.adoption.adopt_refined("v", "left") == adopted
    assert len(stock.venues.history("v", None, 9)) == 3
    stock.adoption.adopt_refined("v", "right")
    assert along(stock) == {"left": -0.999, "right": -0.999}


def test_a_camera_without_one_is_refused_and_nothing_is_written(stock):
    stock.venue("v")
    stock.calibrated("v")
    with refused("refined-not-found"):
        stock.adoption.adopt_refined("v", "left")
    assert len(stock.venues.history("v", None, 9)) == 2


def test_a_calibration_that_runs_meanwhile_is_rejected(stock):
    stock.venue("v")
    night(stock)
    running = stock.attempts.begin(stock.submitted("v"))
    stock.adoption.adopt_refined("v", "left")
    stock.attempts.finish(running, result(running.venue, True), [])
    assert stock.jobs.get(running.job_id).result.rejected_because == "the venue was changed while the job ran"


def test_a_job_that_was_deleted_takes_its_refined_poses_along(stock):
    stock.venue("v")
    stock.expiry.delete_jobs([night(stock)], stock.expiry.now())
    with stock.engine.connect() as connection:
        assert connection.scalar(sa.select(sa.func.count()).select_from(tables.jobs)) == 0
    assert along(stock) == {}
