"""The trend of a camera through the front door."""

from datetime import UTC, datetime, timedelta

import pytest

from tests.problems import problem_of


def trend(service, name, camera="left", **params):
    return service.http.get(f"/venues/{name}/cameras/{camera}/trend", params=params)


def test_a_night_has_its_displacement_its_focal_length_and_its_charts(service, name):
    service.calibrated(service.venue(name))
    job = service.calibrated(name)["id"]
    found = trend(service, name).json()
    assert (found["venue"], found["camera"], found["anchor"], found["state"]) == (name, "left", 1, "too-few-nights")
    (night,) = found["points"]
    # The anchor itself and a job 5 cm from it, on one day.
    assert (night["job"], night["jobs"], night["displacement_m"]) == (job, 2, pytest.approx(0.025))
    assert (night["across_m"], night["away_m"]) == pytest.approx((0.015, 0.02))
    assert night["focal_length"] == pytest.approx(0.0001)
    assert [chart["quantity"] for chart in night["charts"]] == ["across", "away", "focal-length"]
    assert all(chart["ewma_limit"] > 0 and not chart["beyond"] for chart in night["charts"])


def test_a_trend_is_not_sent_twice_and_begins_where_it_is_asked_to(service, name):
    service.calibrated(service.venue(name))
    first = trend(service, name)
    tag = {"If-None-Match": first.headers["etag"]}
    again = service.http.get(f"/venues/{name}/cameras/left/trend", headers=tag)
    assert (again.status_code, again.content) == (304, b"")
    tomorrow = (datetime.now(UTC) + timedelta(days=1)).date()
    assert trend(service, name, since=tomorrow.isoformat()).json()["points"] == []
    assert len(trend(service, name, since="2026-01-01").json()["points"]) == 1


def test_a_venue_that_waits_for_its_first_pose_has_an_empty_trend(service, name):
    service.venue(name)
    found = trend(service, name).json()
    assert (found["anchor"], found["points"], found["alarm_m"]) == (None, [], 0.05)
    assert found["words"] == "Camera left has had no pose accepted since it was put."


def test_what_there_is_no_trend_of_is_said(service, name):
    service.venue(name)
    camera = trend(service, name, "elsewhere")
    assert problem_of(camera) == (404, "no-such-camera")
    assert trend(service, "nowhere").status_code == 404
    assert [trend(service, name, since=day).status_code for day in ("yesterday", "0", "20261103")] == [422] * 3
