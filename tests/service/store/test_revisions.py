"""The history of a venue, and the ways back."""

import pytest

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import result
from tests.problems import refused


def told(stock):
    return [(r.revision, r.cause, r.job, r.restored_from) for r in stock.venues.history("v", None, 100)]


def standing(stock):
    return round(stock.venues.get("v").cameras[0].pose.position[0], 6)


@in_both_homes
def test_every_change_of_the_poses_is_a_revision_with_its_cause(stock):
    stock.venue("v")
    job = stock.calibrated("v")
    stock.calibrated("v", accepted=False)
    stock.calibrated("v", dry_run=True)
    stock.moved_by_hand("v", -3.0)
    stock.venues.restore("v", 1)
    assert told(stock) == [
        (4, "restored", None, 1),
        (3, "put", None, None),
        (2, "calibrated", job, None),
        (1, "put", None, None),
    ]
    newest, before = stock.venues.history("v", None, 2)
    assert (newest.at >= before.at, stock.venues.history("v", 3, 1)[0].revision) == (True, 2)
    assert stock.venues.history("v", 3, 1)[0].stitch_error_px == 0.2


def test_a_put_that_moves_nothing_is_no_revision(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"name": "renamed"}))
    stock.venues.put(venue.model_copy(update={"field": FieldOfPlay(length_m=104, width_m=68)}))
    assert told(stock) == [(1, "put", None, None)]


KNOWN = {"fx": 0.5, "k1": 0.01}


def known_to(venue, sigma):
    """The venue with all its lenses known so well."""
    cameras = [
        camera.model_copy(update={"intrinsics": camera.intrinsics.model_copy(update={"sigma": sigma})})
        for camera in venue.cameras
    ]
    return venue.model_copy(update={"cameras": cameras})


def known(stock):
    return [camera.intrinsics.sigma for camera in stock.venues.get("v").cameras]


def test_how_well_a_lens_is_known_is_kept_and_no_revision(stock):
    stock.venues.put(known_to(stock.venue("v"), KNOWN))
    assert (known(stock), told(stock)) == ([KNOWN] * 2, [(1, "put", None, None)])
    stock.moved_by_hand("v", -3.0)
    # The other camera was not put elsewhere by being known better.
    assert [camera.drift_since for camera in stock.venues.history("v", None, 1)[0].cameras] == [2, 1]


def test_an_older_revision_with_the_same_lens_is_known_as_well_as_now(stock):
    stock.venue("v")
    stock.moved_by_hand("v", -3.0)
    stock.venues.put(known_to(stock.venue("v"), KNOWN))
    stock.venues.restore("v", 1)
    assert (standing(stock), known(stock)) == (-1.0, [KNOWN] * 2)
    stock.moved_by_hand("v", -2.0, intrinsics=Intrinsics(matrix=[[61, 0, 32], [0, 61, 24], [0, 0, 1]], distortion=[]))
    stock.venues.restore("v", 2)
    # Of the lens of that time what was known then.
    assert known(stock) == [None, KNOWN]


def test_a_lens_that_is_known_better_meanwhile_stops_no_result(stock):
    stock.venue("v")
    running = stock.attempts.begin(stock.submitted("v"))
    stock.venues.put(known_to(stock.venue("v"), KNOWN))
    stock.attempts.finish(running, result(running.venue, True), [])
    assert (standing(stock), known(stock)) == (-0.999, [KNOWN] * 2)
    stock.venues.put(known_to(stock.venue("v"), None))
    stock.decisions.reject(running.job_id)
    stock.decisions.accept(running.job_id)
    assert standing(stock) == -0.999


@in_one_home_first
def test_drift_is_counted_from_where_each_camera_was_put(stock):
    stock.venue("v")
    for _ in range(3):
        stock.calibrated("v")
    left, right = stock.venues.history("v", None, 1)[0].cameras
    assert (left.moved.position_m, left.drift.position_m) == (pytest.approx(0.001), pytest.approx(0.003))
    assert left.drift.pixels == pytest.approx(3 * left.moved.pixels, rel=0.01)
    assert (left.drift_since, right.drift_since) == (1, 1)
    stock.moved_by_hand("v", -3.0)
    stock.calibrated("v")
    left, right = stock.venues.history("v", None, 1)[0].cameras
    assert (left.drift_since, left.drift.position_m) == (5, pytest.approx(0.001))
    assert (right.drift_since, right.drift.position_m) == (1, pytest.approx(0.004))


@in_one_home_first
def test_an_older_revision_holds_again_with_its_lenses_and_its_ridge(stock):
    stock.venue("v")
    longer = Intrinsics(matrix=[[61, 0, 32], [0, 61, 24], [0, 0, 1]], distortion=[])
    before = stock.venues.get("v")
    ridge = [[-10.0, 0.0, 0.2], [10.0, 0.0, 0.2]]
    crowned = before.model_copy(update={"field": before.field.model_copy(update={"ridge": ridge})})
    stock.venues.put(crowned)
    stock.moved_by_hand("v", -3.0, intrinsics=longer)
    stock.venues.restore("v", 1)
    assert stock.venues.get("v") == before
    stock.venues.restore("v", 3)
    assert (stock.venues.get("v").cameras[0].intrinsics, stock.venues.get("v").field.ridge) == (longer, ridge)
    # What is restored drifts from where the restored one was put.
    assert [camera.drift_since for camera in stock.venues.history("v", None, 1)[0].cameras] == [3, 1]


def test_what_holds_anyway_is_not_restored(stock):
    stock.venue("v")
    stock.venues.restore("v", 1)
    assert told(stock) == [(1, "put", None, None)]


def test_a_revision_that_does_not_fit_is_refused(stock):
    venue = stock.venue("v")
    crown = venue.field.model_copy(update={"ridge": [[-50.0, 0.0, 0.2], [50.0, 0.0, 0.2]]})
    stock.venues.put(venue.model_copy(update={"field": crown}))
    small = FieldOfPlay(length_m=91, width_m=68)
    stock.venues.put(venue.model_copy(update={"field": small}))
    with refused("revision-unfit", "ridge"):
        stock.venues.restore("v", 2)
    stock.venues.put(venue.model_copy(update={"cameras": venue.cameras[:1]}))
    with refused("revision-unfit", r"left \(64x48\), right \(64x48\), and the venue now has left \(64x48\)"):
        stock.venues.restore("v", 1)
    with refused("revision-not-found"):
        stock.venues.restore("v", 9)


def test_a_venue_that_is_made_again_has_a_history_of_its_own(stock):
    stock.venue("v")
    stock.moved_by_hand("v", -3.0)
    stock.venues.delete("v")
    stock.venue("v")
    assert told(stock) == [(1, "put", None, None)]


# By hand


@pytest.mark.parametrize("how", [{"accepted": False}, {"dry_run": True}])
def test_a_result_that_did_not_move_the_venue_can_be_taken_by_hand(stock, how):
    stock.venue("v")
    job = stock.calibrated("v", **how)
    assert (standing(stock), stock.jobs.get(job).venue_revision) == (-1.0, None)
    for _ in range(2):
        stock.decisions.accept(job)
    assert (standing(stock), stock.jobs.get(job).venue_revision) == (-0.999, 2)
    assert told(stock) == [(2, "accepted", job, None), (1, "put", None, None)]


@in_one_home_first
def test_what_was_taken_can_be_given_back_and_taken_again(stock):
    stock.venue("v")
    job = stock.calibrated("v")
    for _ in range(2):
        stock.decisions.reject(job)
    assert (standing(stock), told(stock)[0]) == (-1.0, (3, "restored", job, 1))
    stock.decisions.accept(job)
    assert (standing(stock), told(stock)[0]) == (-0.999, (4, "accepted", job, None))
    stock.decisions.reject(job)
    assert (standing(stock), told(stock)[0]) == (-1.0, (5, "restored", job, 3))


def test_nothing_by_hand_undoes_what_came_later(stock):
    stock.venue("v")
    rejected, taken = stock.calibrated("v", accepted=False), stock.calibrated("v")
    with refused("venue-moved-on") as moved:
        stock.decisions.accept(rejected)
    assert moved.value.parts["got"] == 2
    assert told(stock)[0] == (2, "calibrated", taken, None)


def test_giving_back_what_never_held_changes_nothing(stock):
    stock.venue("v")
    stock.decisions.reject(stock.calibrated("v", accepted=False))
    assert told(stock) == [(1, "put", None, None)]


def test_a_job_without_poses_has_none_to_take(stock):
    stock.venue("v")
    waiting = stock.submitted("v")
    for decide in (stock.decisions.accept, stock.decisions.reject):
        with refused("poses-not-found"):
            decide(waiting)


def test_poses_that_were_found_for_another_venue_are_not_taken(stock):
    venue = stock.venue("v")
    job = stock.calibrated("v", accepted=False)
    stock.venues.put(venue.model_copy(update={"field": FieldOfPlay(length_m=104, width_m=68)}))
    with refused("venue-moved-on"):
        stock.decisions.accept(job)


def test_what_is_decided_while_a_job_runs_is_not_undone_by_its_result(stock):
    stock.venue("v")
    first = stock.calibrated("v")
    running = stock.attempts.begin(stock.submitted("v"))
    stock.decisions.reject(first)
    stock.attempts.finish(running, result(running.venue, True), [])
    assert (standing(stock), stock.jobs.get(running.job_id).result.accepted) == (-1.0, False)
