"""The trend of each camera on the page of its venue."""

import re
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from playwright.sync_api import expect

from service.pages.alarm_suggestions import suggested_limits
from service.pages.page_rendering import templates
from service.pages.trend_curves import trend_curves
from service.schemas.geometry import Moved
from service.schemas.trend import Chart, Trend, TrendPoint
from testbed.stock import Stock
from tests.pages.browsing import differs, in_each_scheme, look
from tests.trending import nights, noisy

SUMMER = datetime(2026, 6, 1, 2, tzinfo=UTC)


@pytest.fixture(scope="package")
def drifted(stub):
    """A venue whose cameras were quiet for thirty nights and have drifted for thirty more."""
    stock = Stock(stub.data)
    first = datetime.now(UTC) - timedelta(days=60)
    nights(stock, 60, first, noisy(5, lambda number: 0.003 * max(0, number - 30)))
    stock.engine.dispose()
    return "/ui/venues/v"


def test_a_venue_without_a_trend_shows_none(stub, visit):
    stub.venue("new")
    page = visit(stub.url, "/ui/venues/new")
    expect(page.get_by_role("heading", name="Trend of each camera")).to_have_count(0)


def test_each_camera_says_how_far_it_has_moved_and_draws_it(stub, drifted, visit):
    page = visit(stub.url, drifted)
    panel = page.get_by_role("region", name="Trend of each camera")
    expect(panel.locator(".badge")).to_have_text(["Alarm", "Alarm"])
    said = stub.http.get("/venues/v/cameras/left/trend").json()["words"]
    expect(panel.get_by_text(said)).to_be_visible()
    # No alarm of the venue tells it.
    expect(page.locator("p.note", has_text=said)).to_be_visible()
    for chart in ("Moved at the far touchline", "Focal length"):
        for camera in ("left", "right"):
            expect(panel.get_by_role("img", name=f"Camera {camera}. {chart}")).to_be_visible()
    moved = panel.get_by_role("img", name="Camera left. Moved")
    assert moved.locator("circle").count() == 60
    assert moved.locator("circle.drifting, circle.alarm").count() > 10
    expect(moved.locator("circle.alarm title").last).to_have_text(re.compile(r"\d+ \w+ 20\d\d: \d+\.\d ± \d\.\d cm"))


def test_band_average_and_dots_can_be_told_from_the_ground(stub, drifted, visit):
    page = visit(stub.url, drifted)
    chart = page.get_by_role("img", name="Camera left. Moved")
    for scheme in in_each_scheme(page):
        drawn = look(chart)
        for part in (".band", ".average", ".quiet", ".drifting, .alarm"):
            chart.locator(part).evaluate_all("all => all.forEach(one => one.style.visibility = 'hidden')")
            without = look(chart)
            assert differs(drawn, without) > 0.0005, (scheme, part)
            drawn = without
        chart.locator("*").evaluate_all("all => all.forEach(one => one.style.visibility = '')")


def test_the_charts_fit_a_phone(stub, drifted, visit):
    page = visit(stub.url, drifted)
    page.set_viewport_size({"width": 390, "height": 800})
    page.locator("summary", has_text="Trend of each camera").click()
    box = page.get_by_role("img", name="Camera left. Moved").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390


def point(number, across_m, focal_length=None, *, beyond=False):
    """A night on which a camera is so far from its anchor, and usually is there."""
    charted = [("across", across_m), ("away", 0.0)]
    charted += [("focal-length", focal_length)] if focal_length is not None else []
    charts = [
        Chart(
            quantity=quantity,
            value=0.0,
            mean=0.0,
            mean_m=0.04 if beyond else 0.0,
            spread=0.01,
            ewma=0.0,
            ewma_limit=1.0,
            cusum_high=0.0,
            cusum_low=0.0,
            beyond=beyond,
        )
        for quantity, _ in charted
    ]
    return TrendPoint(
        at=SUMMER + timedelta(days=number),
        job="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
        jobs=1,
        displacement_m=abs(across_m),
        sigma_m=0.01,
        across_m=across_m,
        away_m=0.0,
        rotation_deg=0.0,
        sigma_rotation_deg=None,
        position_m=0.0,
        sigma_position_m=None,
        focal_length=focal_length,
        sigma_focal_length=None if focal_length is None else 1e-4,
        charts=charts,
        state="drifting" if beyond else "quiet",
    )


def trend(points, state="quiet", **told):
    told = {"words": "", "alarm_m": 0.05, "moved_m": 0.0, "baseline_nights": len(points), **told}
    return Trend(venue="v", camera="left", anchor=1, since=SUMMER, state=state, points=points, **told)


def curves(points):
    return trend_curves(trend(points))


@pytest.mark.parametrize(
    ("state", "badge"),
    [("too-few-nights", "plain"), ("jumped", "part"), ("quiet", "good"), ("drifting", "part"), ("alarm", "bad")],
)
def test_a_single_night_is_told_in_words_and_not_drawn(state, badge):
    shown = templates.get_template("parts.html").module.trend(
        trend([point(0, 3.15)], state, words="Camera left stands")
    )
    assert f'class="badge {badge}"' in shown
    assert ("Quiet" in shown) == (state == "quiet")
    assert "Camera left stands" in shown
    assert "<svg viewBox" not in shown
    assert "<svg viewBox" in templates.get_template("parts.html").module.trend(trend([point(0, 0.0), point(1, 3.15)]))


NIGHTLY = timedelta(days=1)


def end(number, moved_px, *, accepted=True):
    moved = {"left": Moved(rotation_deg=0.0, position_m=0.0, pixels=moved_px)}
    return SimpleNamespace(
        accepted=accepted, dry_run=False, moved=moved, moved_px=moved_px, finished_at=SUMMER - number * NIGHTLY
    )


def test_limits_of_alarms_are_suggested_by_nights_once_there_are_enough_of_them():
    few = [end(number, 1.0) for number in range(19)]
    assert suggested_limits(few, [], [trend([point(0, 0.0)])]) == {"trend_m": "0.05"}
    ends = [end(number, 1.0 + 0.1 * (number % 5), accepted=number not in (7, 8)) for number in range(40)]
    quiet = trend([point(number, 0.0) for number in range(20)])
    assert suggested_limits(ends, [], [quiet]) == {
        "moved_since_last_px": "1.7",
        "rejected_in_a_row": "3",
        "not_calibrated_for_h": "48",
        "trend_m": "0.03",
    }


def test_harmless_noise_looks_harmless():
    (curve,) = curves([point(n, 0.001) for n in range(5)])
    assert curve.levels[-1].label == "2.0"


def test_a_focal_length_may_be_shorter_and_is_drawn_around_zero():
    _, curve = curves([point(n, 0.0, focal_length=-0.002 * n) for n in range(3)])
    assert [tick.is_zero for tick in curve.levels].count(True) == 1
    assert float(curve.levels[0].label) <= -0.4
    assert curve.dots[0].y < curve.dots[-1].y


def test_nights_on_which_no_focal_length_was_asked_for_are_left_out_of_its_chart():
    moved, lens = curves([point(0, 0.0), point(1, 0.0, focal_length=0.0), point(2, 0.0)])
    assert (len(moved.dots), len(lens.dots)) == (3, 1)


def test_of_very_many_nights_only_those_have_dots_that_a_chart_has_told():
    (curve,) = curves([point(n, 0.01, beyond=n > 180) for n in range(200)])
    assert {dot.state for dot in curve.dots} == {"alarm"}
    assert len(curve.dots) == 19


def test_years_are_told_where_there_are_two():
    labels = [tick.label for tick in curves([point(n, 0.0) for n in range(0, 400, 5)])[0].dates]
    assert [label[-4:] for label in labels if label[-4:].isdigit()] == ["2026", "2027"]
