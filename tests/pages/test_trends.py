"""The trend of each camera on the page of its venue."""

import re
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from playwright.sync_api import expect

from service.pages.alarm_suggestions import suggested_limits
from service.pages.page_rendering import templates
from service.pages.trend_charts import trend_charts
from service.schemas.geometry import Moved
from service.schemas.trend import Chart, Trend, TrendPoint
from testbed.stock import Stock
from tests.pages.browsing import in_each_scheme
from tests.trending import nights, noisy

COLOUR_OF = """
name => {
    const pen = document.createElement("canvas").getContext("2d");
    pen.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(name);
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data].join();
}
"""
DRAWN = """
place => {
    const canvas = place.querySelector("canvas");
    const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const seen = new Set();
    for (let at = 0; at < data.length; at += 4) seen.add(data.slice(at, at + 4).join());
    return [...seen];
}
"""
SUMMER = datetime(2026, 6, 1, 2, tzinfo=UTC)


@pytest.fixture(scope="package")
def drifted(stub):
    """A venue whose cameras were quiet for twenty nights and have drifted for ten more."""
    stock = Stock(stub.data)
    first = datetime.now(UTC) - timedelta(days=30)
    nights(stock, 30, first, noisy(5, lambda number: 0.012 * max(0, number - 20)))
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
    # The legend has the figures of the night under the pointer.
    moved = panel.get_by_role("img", name="Camera left. Moved")
    moved.locator(".u-over").hover()
    expect(moved.locator(".u-legend")).to_contain_text(re.compile(r"20\d\d-\d\d-\d\d.*\d+\.\d ± \d\.\d cm", re.DOTALL))


@pytest.mark.long
def test_band_average_and_dots_can_be_told_from_the_ground(stub, drifted, visit):
    page = visit(stub.url, drifted)
    chart = page.get_by_role("img", name="Camera left. Moved")
    for scheme in in_each_scheme(page):
        colours = drawn_colours(chart)
        for name in ("--new", "--text", "--live", "--bad"):
            assert page.evaluate(COLOUR_OF, name) in colours, (scheme, name)


def drawn_colours(chart):
    chart.locator("canvas").wait_for()
    return chart.evaluate(DRAWN)


@pytest.mark.long
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
    assert "data-trend" not in shown
    assert "data-trend" in templates.get_template("parts.html").module.trend(trend([point(0, 0.0), point(1, 3.15)]))


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


def test_a_movement_is_drawn_from_zero_and_a_focal_length_around_it_with_harmless_noise_small():
    moved, lens = trend_charts(trend([point(n, 0.001, focal_length=-0.002 * n) for n in range(3)]))
    assert moved.data["scale"] == (0.0, 2.0)
    assert moved.data["value"] == [0.1, 0.1, 0.1]
    assert lens.data["scale"] == (-0.05, 0.05)
    assert lens.data["value"] == [0.0, -0.2, -0.4]


def test_nights_on_which_no_focal_length_was_asked_for_are_left_out_of_its_chart():
    moved, lens = trend_charts(trend([point(0, 0.0), point(1, 0.0, focal_length=0.0), point(2, 0.0, beyond=True)]))
    assert moved.data["state"] == ["quiet", "quiet", "alarm"]
    assert lens.data["state"] == ["quiet"]
