"""The stitched view on the page of its venue: the knobs and what they do, kept, and the packages of it."""

import io
import json
import re
import zipfile

import pytest
from playwright.sync_api import expect

from tests.pages import newcomer
from tests.pages.browsing import differs, grave, look, wait_until


@pytest.fixture(scope="package")
def pitch(stub):
    """A venue with true poses whose frames show something."""
    venue = newcomer.scaled().model_dump(mode="json") | {"id": "viewed", "name": "accept"}
    for camera in venue["cameras"]:
        camera["pose"] = newcomer.TRUTH[camera["id"]].model_dump(mode="json")
    stub.http.put("/venues/viewed", json=venue).raise_for_status()
    frames = [(side, (f"{side}.jpg", newcomer.frame(side)["buffer"])) for side in ("left", "right")]
    stub.end(stub.http.post("/venues/viewed/calibrate", files=frames).raise_for_status().json()["id"])
    # The program in place of the engine moves cameras.
    stub.http.put("/venues/viewed", json=venue).raise_for_status()
    return "viewed"


def settled(page):
    """Return a screenshot of the picture after it shows the chosen view."""
    page.wait_for_timeout(300)
    wait_until(page, "document.getElementById('view-picture').ariaBusy === 'false'")
    return look(page.locator("#view-picture"))


@pytest.mark.long
def test_the_picture_follows_the_knobs_and_the_seam_can_be_seen(stub, pitch, visit):
    page = visit(stub.url, f"/ui/venues/{pitch}#view")
    page.locator("#view-picture").scroll_into_view_if_needed()
    usual = settled(page)
    assert usual.std() > 10
    page.get_by_label("Show the seam").check()
    assert 0.0005 < differs(usual, settled(page)) < 0.05
    page.get_by_label("Show the seam").uncheck()
    assert differs(usual, settled(page)) == 0
    page.get_by_label("Pan to the right, °", exact=True).fill("8")
    panned = settled(page)
    assert panned.shape != usual.shape or differs(usual, panned) > 0.2
    expect(page.get_by_label("Pan to the right, °, knob")).to_have_value("8")
    page.get_by_label("Projection").select_option("birds-eye")
    expect(page.get_by_label("Field of view, °", exact=True)).to_be_disabled()
    assert settled(page).shape[0] > 1.5 * panned.shape[0]
    page.get_by_role("button", name="Reset").click()
    assert differs(usual, settled(page)) == 0
    assert grave(page) == []


@pytest.mark.long
def test_a_view_is_kept_and_its_package_fetched(stub, pitch, visit):
    page = visit(stub.url, f"/ui/venues/{pitch}#view")
    page.get_by_label("Projection").select_option("cylinder")
    page.get_by_label("Width of the view, px").fill("640")
    page.get_by_label("Height of the view, px").fill("200")
    page.get_by_label("Horizon, from 0 at the top to 1, knob").fill("0.3")
    link = page.get_by_role("link", name="Download the stitched view for OpenCV")
    package = page.request.get(link.get_attribute("href")).body()
    chosen = {
        "projection": "cylinder",
        "width_px": 640,
        "height_px": 200,
        "field_of_view_deg": None,
        "pan_deg": 0.0,
        "horizon": 0.3,
    }
    with zipfile.ZipFile(io.BytesIO(package)) as files:
        assert json.loads(files.read("view.json"))["view"] == chosen
    assert stub.http.get(f"/venues/{pitch}").json()["view"] is None
    with page.expect_navigation():
        page.get_by_role("button", name="Save", exact=True).click()
    assert stub.http.get(f"/venues/{pitch}").json()["view"] == chosen
    expect(page.get_by_label("Width of the view, px")).to_have_value("640")
    expect(page.get_by_label("Field of view, °", exact=True)).to_have_value("")


def test_a_view_is_not_kept_over_what_somebody_else_has_changed(stub, visit):
    page = visit(stub.url, forgiven=("412",))
    # A page that hears of the change is right by itself before anybody presses the button.
    page.route("**/events*", lambda route: None)
    page.goto(f"/ui/venues/{stub.venue('shared')}#view")
    expect(page.get_by_text("The first calibration that is accepted brings the frames")).to_be_visible()
    stub.venue("shared", "renamed")
    page.get_by_label("Width of the view, px").fill("640")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#view-refused")).to_have_text(re.compile("Somebody has changed the venue"))
    assert stub.http.get("/venues/shared").json()["view"] is None


@pytest.mark.long
def test_a_view_without_its_frames_says_so(stub, visit):
    job = stub.calibrated(stub.venue("bare"))
    stub.venue("bare", cameras=("left", "third"))
    page = visit(stub.url, "/ui/venues/bare#view", forgiven=("404",))
    page.locator("#view-picture").scroll_into_view_if_needed()
    expect(page.locator("#view-refused")).to_have_text(
        "The next calibration that is accepted brings a frame of each camera."
    )
    assert job["result"]["accepted"]
