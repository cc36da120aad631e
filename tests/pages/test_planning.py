"""A plan before the cameras are mounted, and the way from it to a new venue."""

import json
import re

import pytest
from playwright.sync_api import expect

from testbed.running import png
from tests.pages.browsing import differs, grave, look


def planned(page):
    """The plan of one camera at a volleyball court."""
    page.get_by_label("Sport").select_option("volleyball")
    expect(page.get_by_label("Length, m")).to_have_attribute("placeholder", "18")
    page.get_by_role("button", name="Remove").last.click()
    page.get_by_label("Looks at x, m").fill("0")
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.get_by_role("heading", name="All cameras can be calibrated")).to_be_visible()
    return page


def test_cameras_are_planned_moved_and_taken_to_a_new_venue(stub, visit):
    page = planned(visit(stub.url, "/ui/plan"))
    row = page.locator("#cameras-planned tr")
    expect(row).to_have_count(1)
    expect(row.locator("[data-label='A player\\'s place']")).to_have_text(re.compile(r"± [\d.]+ cm, worst [\d.]+ cm"))
    place = look(page.locator("#map"))
    page.get_by_label("Pixels per metre").check()
    expect(page.get_by_role("img", name="The field from above: Pixels per metre")).to_be_visible()
    assert differs(place, look(page.locator("#map"))) > 0.02
    before = page.locator("#place").inner_text()
    page.get_by_label("Height, m").fill("12")
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.locator("#place")).not_to_have_text(before)
    page.get_by_role("button", name="New venue with these cameras").click()
    expect(page.get_by_text("Planned: left.")).to_be_visible()
    expect(page.get_by_label("Sport")).to_have_value("volleyball")
    page.locator("#frames .drop-zone input").set_input_files(
        {"name": "left.png", "mimeType": "image/png", "buffer": png()}
    )
    page.route("**/find", lambda route: route.abort())
    with page.expect_request("**/find") as sent:
        page.get_by_role("button", name="Find the cameras").click()
    (camera,) = json.loads(re.search(r'\{"id".*\}', sent.value.post_data_buffer.decode("latin-1"))[0])["cameras"]
    assert (camera["id"], camera["position"][2], camera["field_of_view_deg"]) == ("left", 12, 75)


@pytest.mark.long
def test_a_plan_says_what_is_missing_and_why_a_camera_cannot_be_calibrated(stub, visit):
    page = visit(stub.url, "/ui/plan", forgiven=("422",))
    make = page.get_by_role("button", name="Plan", exact=True)
    page.get_by_label("Height, m").first.fill("")
    expect(page.get_by_text("Still missing: an id and all numbers of each camera.")).to_be_visible()
    expect(make).to_be_disabled()
    page.get_by_label("Height, m").first.fill("-1")
    make.click()
    expect(page.get_by_text("camera left stands at z = -1 m")).to_be_visible()
    page.get_by_label("Height, m").first.fill("12")
    page.get_by_label("Looks at y, m").first.fill("-90")
    make.click()
    expect(page.get_by_role("heading", name="Cannot be calibrated: left")).to_be_visible()
    expect(page.get_by_label("Warnings")).to_contain_text("left: no marking of the field is in view")
    assert grave(page) == []
