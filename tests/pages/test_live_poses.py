"""The card of live poses on the page of a venue: it is there where there are any, and goes with each report."""

import pytest
from playwright.sync_api import expect

from tests.pages.browsing import grave, tab
from tests.pages.stocked import LIVE, live_minutes
from tests.pages.test_layout import PHONE, inside


def told(stub, name, **left):
    first, *others = LIVE["cameras"]
    report = LIVE | {"cameras": [first | left, *others]}
    stub.http.put(f"/venues/{name}/live", json=report).raise_for_status()


@pytest.fixture
def sent(stub):
    """A venue whose live poses are sent, for a quarter of an hour so far."""
    name = stub.venue("sent-live")
    with stub.database() as connection:
        live_minutes(connection, name, 15)
    told(stub, name)
    yield name
    stub.http.delete(f"/venues/{name}").raise_for_status()


def test_a_venue_that_was_never_live_has_no_card(stub, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('never-live')}")
    expect(page.get_by_role("heading", name="Revisions of the poses")).to_be_visible()
    expect(page.get_by_role("heading", name="Live", exact=True)).to_have_count(0)


def test_the_card_moves_with_each_report_and_says_when_none_comes_any_more(stub, visit, sent):
    page = visit(stub.url, f"/ui/venues/{sent}")
    page.evaluate("window.opened = true")
    left = page.locator("[data-camera=left]")
    expect(left.locator("[data-turned]")).to_have_text("0.031°")
    expect(left.locator(".turns")).to_contain_text("up to 0.090°")
    expect(page.locator("[data-camera=right]").get_by_text("Stored pose")).to_be_visible()
    told(stub, sent, status="coasted", turned_deg=0.5, latency_ms={"p50": 41, "p99": 999})
    expect(left.get_by_text("Lines not seen")).to_be_visible()
    expect(left.get_by_text("Measured")).to_be_hidden()
    expect(left.locator("[data-turned]")).to_have_text("0.500°")
    expect(left.locator("[data-latency]")).to_have_text("41 / 999 ms")
    expect(left.get_by_text("arrival")).to_be_visible()
    # No more reports come.
    expect(page.locator("[data-ended]")).to_be_visible()
    expect(left.get_by_text("Not running")).to_be_visible()
    assert page.evaluate("window.opened")


@pytest.mark.long
def test_the_card_is_for_everybody_and_fits_a_phone(stub, people, sent):
    with tab(people(stub.url)) as page:
        page.set_viewport_size(PHONE)
        page.goto(f"/ui/venues/{sent}")
        cells = page.locator("[data-camera] > *").all()
        assert len(cells) == 12
        assert all(inside(page, cell) for cell in cells)
        assert grave(page) == []
