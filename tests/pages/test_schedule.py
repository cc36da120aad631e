"""The schedule of a venue on its page: made, tried, ended; and times by the viewer's own clock."""

import re

import pytest
from playwright.sync_api import expect

from testbed.network_cameras import NetworkCamera
from tests.pages.browsing import press_and_confirm

ZONE = "Asia/Tokyo"


@pytest.fixture(scope="module")
def camera():
    return NetworkCamera()


def test_a_schedule_is_made_tried_and_ended(stub, camera, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('timed')}", zone=ZONE)
    expect(page.get_by_role("button", name="Try it now")).to_have_count(0)
    expect(page.get_by_label("Time zone")).to_have_value(ZONE)
    page.get_by_label("Cron schedule").fill("0 3 * * *")
    for side in ("left", "right"):
        page.get_by_label(f"Source of {side}").fill(camera.url("/ok"))
    page.get_by_role("button", name="Save schedule").click()
    schedule = page.get_by_role("region", name="Schedule")
    # Nine hours before UTC, and with others of the same time up to a quarter of an hour later.
    expect(schedule.get_by_role("definition").nth(1)).to_have_text(
        re.compile(r"^20\d\d-\d\d-\d\d 03:(0\d|1[0-4]):\d\d GMT\+9$")
    )
    expect(schedule.get_by_text("not yet")).to_be_visible()
    page.get_by_role("button", name="Try it now").click()
    page.wait_for_url("**/ui/jobs/*")
    expect(page.get_by_text("Accepted")).to_be_visible()
    page.goto("/ui/venues/timed")
    page.get_by_label("Start exactly on time").check()
    page.get_by_role("button", name="Save schedule").click()
    expect(schedule.get_by_role("definition").nth(1)).to_have_text(re.compile("03:00:00"))
    press_and_confirm(page.get_by_role("button", name="End schedule"))
    expect(page.get_by_role("button", name="End schedule")).to_have_count(0)
    assert stub.http.get("/venues/timed").json()["schedule"] is None


def test_what_is_wrong_with_a_schedule_is_said_beside_it(stub, camera, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('wrong')}", forgiven=("422",))
    refused = page.locator("#schedule-refused")
    page.get_by_role("button", name="Save schedule").click()
    expect(refused).to_contain_text("a schedule needs a source of every camera, and left, right have none")
    for side in ("left", "right"):
        page.get_by_label(f"Source of {side}").fill(camera.url("/ok"))
    page.get_by_label("Cron schedule").fill("99 * * * *")
    page.get_by_role("button", name="Save schedule").click()
    expect(refused).to_contain_text("'99 * * * *' is no schedule")


def test_times_are_those_of_the_clock_where_the_viewer_is(stub, visit):
    job = stub.calibrated(stub.venue("clock"))
    page = visit(stub.url, f"/ui/jobs/{job['id']}", zone=ZONE)
    told = page.locator("time[data-at]").first
    expect(told).to_have_text(re.compile(r"GMT\+9$"))
    utc = job["created_at"][:16].replace("T", " ")
    expect(told).to_have_attribute("title", re.compile(f"^{utc}.* UTC$"))
