"""The trend of each camera: counted from its anchor, charted, bounded and undone."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.schemas.health import Alarms
from service.store import tables, venue_fold
from testbed.homes import in_both_homes, in_one_home_first
from tests.trending import SIGMA_M, displacement, night, nights, noisy

pytestmark = pytest.mark.slow

AUTUMN = datetime(2026, 9, 1, 2, tzinfo=UTC)


def trend(stock, camera="left", since=None):
    return stock.trends.of(stock.venue("v"), camera, since)


def moved_m(stock, camera="left"):
    return [pytest.approx(point.across_m) for point in trend(stock, camera).points]


def rows(stock):
    with stock.engine.connect() as connection:
        return connection.scalar(sa.select(sa.func.count()).select_from(tables.camera_trend))


def test_a_venue_that_was_never_calibrated_has_an_empty_trend(stock):
    stock.venue("v")
    found = trend(stock)
    assert (found.state, found.anchor, found.points) == ("too-few-nights", None, [])
    assert found.words == "Camera left has had no pose accepted since it was put."


@in_one_home_first
def test_the_first_accepted_pose_is_the_anchor_and_later_ones_are_counted_from_it(stock):
    nights(stock, 3, AUTUMN, lambda number: displacement(0.01 * (number + 1)))
    # The first was compared with nothing.
    assert moved_m(stock) == [0.0, 0.02, 0.03]
    assert trend(stock).since == AUTUMN
    assert (trend(stock).anchor, trend(stock).baseline_nights) == (1, 3)


def test_a_job_is_given_the_pose_that_its_cameras_are_counted_from(stock):
    assert stock.attempts.begin(stock.submitted("v")).anchors == {}
    stock.decisions.cancel(stock.enqueued[0])
    night(stock, displacement(0.0))
    anchored = stock.venue("v").cameras[0]
    night(stock, displacement(0.02))
    anchor = stock.attempts.begin(stock.submitted("v")).anchors["left"]
    assert (anchor.revision, anchor.posed) == (1, anchored.posed)


def test_rejected_results_and_those_of_older_workers_leave_no_trace(stock):
    night(stock, displacement(0.0))
    night(stock, displacement(0.5), accepted=False)
    night(stock, None)
    assert len(trend(stock).points) == 1


def test_a_camera_that_was_put_elsewhere_begins_anew_and_the_others_go_on(stock):
    nights(stock, 2, AUTUMN, lambda _: displacement(0.01))
    stock.moved_by_hand("v", -3.0)
    assert trend(stock).points == []
    night(stock, displacement(0.04), at=AUTUMN + timedelta(days=2))
    assert (moved_m(stock), moved_m(stock, "right")) == ([0.0], [0.0, 0.01, 0.04])


def test_a_result_that_a_person_accepts_is_the_new_anchor(stock):
    nights(stock, 2, AUTUMN, lambda _: displacement(0.01))
    job = night(stock, displacement(0.3), accepted=False)
    stock.decisions.accept(job)
    assert moved_m(stock) == [0.0]
    night(stock, displacement(0.02))
    (point,) = trend(stock).points
    assert (point.jobs, point.across_m) == (2, pytest.approx(0.01))


@pytest.mark.long
def test_a_person_who_accepts_what_holds_already_says_that_the_camera_is_right_there(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Alarms(trend_m=0.03)}))
    nights(stock, 40, AUTUMN, noisy(1, lambda number: 0.045 if number >= 30 else 0.0))
    assert len(stock.venues.health("v").alarms) == 2
    for _ in range(2):
        stock.decisions.accept(stock.enqueued[-1], ["left"])
        assert (moved_m(stock), trend(stock).state, trend(stock, "right").state) == ([0.0], "too-few-nights", "alarm")
    assert [alarm.camera for alarm in stock.venues.health("v").alarms] == ["right"]
    assert len(stock.venues.history("v", None, 100)) == 41


def test_a_job_that_is_rejected_by_hand_is_taken_out_of_the_trend(stock):
    nights(stock, 2, AUTUMN, lambda _: displacement(0.01))
    stock.decisions.reject(night(stock, displacement(0.2), at=AUTUMN + timedelta(days=2)))
    assert moved_m(stock) == [0.0, 0.01]


@in_both_homes
def test_restoring_takes_the_trend_back_to_what_it_was_then(stock):
    nights(stock, 3, AUTUMN, lambda number: displacement(0.01 * number))
    stock.moved_by_hand("v", -3.0)
    night(stock, displacement(0.0))
    stock.venues.restore("v", 3)
    assert moved_m(stock) == [0.0, 0.01]
    stock.venues.restore("v", 1)
    assert trend(stock).points == []
    assert stock.attempts.begin(stock.submitted("v")).anchors == {}


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_camera_that_jumps_is_never_quiet_and_before_charts_can_tell_its_own_sigma_does(stock, count):
    nights(stock, count, AUTUMN, lambda number: displacement(3.15 if number == count - 1 else 0.0))
    found = trend(stock)
    if count == 4:
        assert (found.state, "beyond what its own spread explains" in found.words) == ("alarm", True)
        return
    assert found.state == "jumped"
    assert found.words.startswith("Camera left stands 315.0 cm ± 1.5 cm from its anchor at the far touchline")
    assert f"too few nights to judge by ({count} of 4)" in found.words
    assert stock.venues.health("v").alarms == []


def test_a_jump_on_the_day_of_the_anchor_counts_in_full_and_one_within_its_sigma_does_not(stock):
    night(stock, displacement(0.0), at=AUTUMN)
    night(stock, displacement(0.04), at=AUTUMN + timedelta(hours=1))
    assert (trend(stock).state, trend(stock).words) == (
        "too-few-nights",
        "Camera left: too few nights to judge by (1 of 4).",
    )
    night(stock, displacement(0.3), at=AUTUMN + timedelta(hours=2))
    assert trend(stock).state == "jumped"
    assert "stands 30.0 cm" in trend(stock).words


def test_a_quiet_camera_is_said_to_be_quiet(stock):
    nights(stock, 24, AUTUMN, noisy(5))
    found = trend(stock)
    assert (found.state, found.baseline_nights) == ("quiet", 20)
    assert found.words == (
        "Camera left has not moved beyond what its own spread explains since 1 September 2026 (24 nights)."
    )
    assert not any(chart.beyond for point in found.points for chart in point.charts)


def test_a_step_is_told_with_its_size_and_its_day_and_rings_where_it_matters(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Alarms(trend_m=0.03)}))
    nights(stock, 34, AUTUMN, noisy(1, lambda number: 0.045 if number >= 22 else 0.0))
    found = trend(stock)
    assert found.state == "alarm"
    assert found.moved_m == pytest.approx(0.045, abs=1.5 * SIGMA_M)
    assert "at the far touchline since 23 September 2026" in found.words
    assert found.words.endswith("beyond what its own spread explains (EWMA and CUSUM).")
    assert [point.state for point in found.points[:22]] == ["too-few-nights"] * 3 + ["quiet"] * 19
    alarms = stock.venues.health("v").alarms
    assert [(alarm.rule, alarm.camera) for alarm in alarms] == [("trend", "left"), ("trend", "right")]
    assert alarms[0].why == found.words


@pytest.mark.long
def test_a_shift_that_is_sure_but_small_drifts_and_rings_nothing(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Alarms(trend_m=0.2)}))
    nights(stock, 40, AUTUMN, noisy(1, lambda number: 0.045 if number >= 30 else 0.0))
    assert trend(stock).state == "drifting"
    assert stock.venues.health("v").alarms == []


def test_a_focal_length_that_creeps_is_named_with_what_it_moves(stock):
    nights(stock, 36, AUTUMN, noisy(2, focal=lambda number: 2e-4 * max(0, number - 24)))
    found = trend(stock)
    assert found.state == "alarm"
    assert found.words.startswith("Camera left has a focal length 0.18% longer since 2")
    assert " September 2026, 10." in found.words
    assert "moved" not in found.words


@in_one_home_first
def test_many_jobs_of_one_day_are_one_night(stock):
    def every_six_hours(number):
        return displacement(0.0 if number == 0 else 0.01 * (number % 2))

    for number in range(8):
        night(stock, every_six_hours(number), at=AUTUMN.replace(hour=0) + timedelta(hours=6 * number))
    first, second = trend(stock).points
    assert (first.jobs, second.jobs) == (4, 4)
    assert second.across_m == pytest.approx(0.005)


@in_both_homes
def test_of_too_many_rows_the_last_of_each_day_and_the_newest_days_are_kept(stock, monkeypatch):
    monkeypatch.setattr(venue_fold, "KEPT_NIGHTS", 4)
    for number in range(6):
        night(stock, displacement(0.01), at=AUTUMN + timedelta(hours=8 * number))
    # The newest row is kept beside those that were too many when it came.
    kept = trend(stock).points
    assert [point.at for point in kept] == [AUTUMN + timedelta(hours=16), AUTUMN + timedelta(hours=40)]
    assert rows(stock) == 2 * 4


@pytest.mark.long
def test_what_is_usual_outlives_the_nights_that_it_was_learnt_from(stock, monkeypatch):
    monkeypatch.setattr(venue_fold, "KEPT_NIGHTS", 25)
    nights(stock, 60, AUTUMN, noisy(3, lambda number: 0.0008 * number))
    assert len(trend(stock).points) == 25
    assert trend(stock).state != "quiet"
    assert trend(stock).moved_m == pytest.approx(0.0008 * 50, abs=SIGMA_M)


def test_nights_before_a_moment_are_left_out_and_charted_all_the_same(stock):
    nights(stock, 5, AUTUMN, noisy(4))
    every, some = trend(stock), trend(stock, since=AUTUMN + timedelta(days=3))
    assert some.points == every.points[3:]
    assert (some.since, some.words) == (every.since, every.words)


@in_both_homes
def test_a_trend_goes_with_its_camera_and_with_its_venue(stock):
    nights(stock, 2, AUTUMN, lambda _: displacement(0.01))
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"cameras": venue.cameras[:1]}))
    assert rows(stock) == 2
    stock.venues.delete("v")
    assert rows(stock) == 0
