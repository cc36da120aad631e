"""What earlier nights measured stays with the poses that it belongs to."""

import pytest
import sqlalchemy as sa
import structlog

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics
from service.store import tables
from service.store.memories import KEPT, LARGEST_BYTES, newest_memories
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import result

pytestmark = pytest.mark.slow

LONGER = Intrinsics(matrix=[[61, 0, 32], [0, 61, 24], [0, 0, 1]], distortion=[])


def night(stock, number, accepted=True, memories=("left", "right"), **options):
    """A job of this number, which ends with memories that have its number; gives its id."""
    task = stock.attempts.begin(stock.submitted("v", **options))
    told = {camera: {"nights": number} for camera in memories}
    stock.attempts.finish(task, result(task.venue, accepted), [], told)
    return task.job_id


def remembered(stock):
    """Of each camera with a memory the number of the last job in it."""
    with stock.engine.connect() as connection:
        return {camera: memory["nights"] for camera, memory in newest_memories(connection, "v").items()}


def rows(stock):
    with stock.engine.connect() as connection:
        return connection.scalar(sa.select(sa.func.count()).select_from(tables.memories))


@in_both_homes
def test_a_job_is_given_the_memories_that_the_last_accepted_one_left(stock):
    stock.venue("v")
    first = stock.attempts.begin(stock.submitted("v"))
    assert first.memories == {}
    stock.attempts.finish(first, result(first.venue, True), [], {"left": {"nights": 1}})
    second = stock.attempts.begin(stock.submitted("v"))
    assert second.memories == {"left": {"nights": 1}}
    assert second.taken_at == stock.jobs.get(second.job_id).created_at


@pytest.mark.parametrize("how", [{"accepted": False}, {"dry_run": True}, {"memories": ()}])
def test_what_moves_no_pose_or_knows_no_memories_leaves_them_as_they_are(stock, how):
    stock.venue("v")
    night(stock, 1)
    night(stock, 2, **how)
    assert remembered(stock) == {"left": 1, "right": 1}


@pytest.mark.parametrize("put", [{}, {"intrinsics": LONGER}])
def test_a_camera_that_is_put_elsewhere_or_has_another_lens_begins_anew(stock, put):
    stock.venue("v")
    night(stock, 1)
    stock.moved_by_hand("v", -0.999 if put else -3.0, **put)
    assert remembered(stock) == {"right": 1}


def test_another_name_or_a_better_known_lens_changes_no_memory(stock):
    stock.venue("v")
    night(stock, 1)
    venue = stock.venue("v")
    known = venue.cameras[0].intrinsics.model_copy(update={"sigma": {"fx": 0.1}})
    cameras = [venue.cameras[0].model_copy(update={"intrinsics": known}), *venue.cameras[1:]]
    stock.venues.put(venue.model_copy(update={"name": "renamed", "cameras": cameras}))
    assert remembered(stock) == {"left": 1, "right": 1}


@in_one_home_first
def test_on_another_field_all_cameras_begin_anew_and_no_undoing_brings_the_nights_back(stock):
    stock.venue("v")
    night(stock, 1)
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"field": FieldOfPlay(length_m=104, width_m=68)}))
    assert (remembered(stock), rows(stock)) == ({}, 0)
    night(stock, 2)
    stock.venues.restore("v", 2)
    assert remembered(stock) == {}


def test_undoing_a_job_takes_its_night_back(stock):
    stock.venue("v")
    night(stock, 1)
    undone = night(stock, 2)
    stock.decisions.reject(undone)
    assert remembered(stock) == {"left": 1, "right": 1}
    # And so does going back to any revision; before the first job there were none.
    stock.venues.restore("v", 3)
    assert remembered(stock) == {"left": 2, "right": 2}
    stock.venues.restore("v", 1)
    assert remembered(stock) == {}


def test_a_camera_whose_refused_pose_is_accepted_by_hand_begins_anew(stock):
    stock.venue("v")
    night(stock, 1)
    partly = night(stock, 2, accepted=["left"])
    stock.decisions.accept(partly)
    assert remembered(stock) == {"left": 2}


def test_a_dry_run_that_is_accepted_by_hand_leaves_the_memories(stock):
    stock.venue("v")
    night(stock, 1)
    stock.decisions.accept(night(stock, 2, dry_run=True))
    assert remembered(stock) == {"left": 1, "right": 1}


@in_both_homes
def test_the_memories_of_the_last_few_revisions_are_kept(stock):
    stock.venue("v")
    for number in range(1, KEPT + 3):
        night(stock, number)
    assert (rows(stock), remembered(stock)) == (KEPT, {"left": KEPT + 2, "right": KEPT + 2})
    stock.venues.restore("v", 2)
    assert remembered(stock) == {}


def test_memories_that_are_too_large_are_dropped_with_the_old_ones_and_logged(stock):
    stock.venue("v")
    night(stock, 1)
    with structlog.testing.capture_logs() as lines:
        task = stock.attempts.begin(stock.submitted("v"))
        stock.attempts.finish(task, result(task.venue, True), [], {"left": {"nights": "x" * LARGEST_BYTES}})
    assert remembered(stock) == {}
    (line,) = (line for line in lines if line["event"] == "memories too large, dropped")
    assert (line["venue"], line["most"]) == ("v", LARGEST_BYTES)


def test_a_deleted_venue_leaves_no_memories(stock):
    stock.venue("v")
    night(stock, 1)
    stock.venues.delete("v")
    assert rows(stock) == 0


@in_one_home_first
def test_memories_expire_with_the_revision_that_they_came_with(stock):
    stock.venue("v")
    for number in range(1, 4):
        night(stock, number)
    stock.time_passes(days=100)
    night(stock, 4)
    assert stock.expiry.expire_revisions(stock.expiry.now(), 100) > 0
    kept = {revision.revision for revision in stock.venues.history("v", None, 100)}
    with stock.engine.connect() as connection:
        assert set(connection.scalars(sa.select(tables.memories.c.revision))) <= kept
    assert remembered(stock) == {"left": 4, "right": 4}
