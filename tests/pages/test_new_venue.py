"""A new venue: what its page sends on, and the whole way from two frames to poses, in a browser, by the real engine."""

import json

import httpx
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.pages import newcomer
from tests.pages.browsing import press_and_confirm

SIGMA = {"fx": 3.5, "fy": 3.5, "k1": 0.002}
EVENTS = "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/events"
POSE = "**/ui/new-venue/pose"


@pytest.fixture
def page(stub, visit):
    """The page on which a camera has been clicked, where photos give its lens and how well they know it."""
    page = visit(stub.url, "/ui/new-venue/by-hand")
    lens = newcomer.VENUE.cameras[0].intrinsics.model_dump() | {"sigma": SIGMA}
    end = json.dumps({"status": "succeeded", "result": {"intrinsics": lens, "rms_px": 0.2, "warnings": []}})
    page.route("**/intrinsics", lambda route: route.fulfill(json={"links": {"events": EVENTS}}))
    page.route(
        f"**{EVENTS}",
        lambda route: route.fulfill(content_type="text/event-stream", body=f"event: end\ndata: {end}\n\n"),
    )
    newcomer.describe_the_pitch(page)
    newcomer.describe_a_camera(page, 0)
    newcomer.click_points(page, 0, newcomer.VENUE.cameras[0].id)
    return page


@pytest.mark.long
def test_how_well_photos_know_a_lens_goes_with_it_until_somebody_changes_its_numbers(page):
    page.get_by_label("Photos of a board").check()
    page.locator("[name=photos]").set_input_files(newcomer.frame("left"))
    with page.expect_request(POSE) as by_photos:
        page.get_by_role("button", name="Find the lens").click()
    assert by_photos.value.post_data_json["intrinsics"]["sigma"] == SIGMA
    expect(page.get_by_text("Found: 0.20 px rms.")).to_be_visible()
    expect(page.locator("[data-verdict]")).to_contain_text("Good")
    with page.expect_request(POSE) as by_hand:
        page.get_by_label("fx, px").fill("2000")
    assert by_hand.value.post_data_json["intrinsics"]["sigma"] is None


def test_a_frame_that_is_not_there_yet_cannot_be_pointed_at(stub, visit):
    page = visit(stub.url, "/ui/new-venue/by-hand")
    newcomer.describe_the_pitch(page)
    # What the script says to its console is looked at when the page is left.
    page.locator(".sighting").first.evaluate(
        """box => {
            for (const kind of ["pointermove", "click"]) box.dispatchEvent(new PointerEvent(kind));
            box.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
        }"""
    )


def poses(url):
    cameras = httpx.get(f"{url}/venues/newcomer").raise_for_status().json()["cameras"]
    return {camera["id"]: np.array(camera["pose"]["position"]) for camera in cameras}


@pytest.mark.long
def test_a_newcomer_comes_to_poses_that_are_right(real):
    for camera, position in poses(real).items():
        assert np.linalg.norm(position - newcomer.TRUTH[camera].position) < 0.05


@pytest.mark.long
def test_what_was_accepted_is_undone_and_restored(real, visit):
    page = visit(real, "/ui/venues/newcomer")
    accepted = poses(real)
    press_and_confirm(page.get_by_role("button", name="Undo"))
    expect(page.get_by_text("In use: revision 3 (poses of revision 1)")).to_be_visible()
    assert any(np.linalg.norm(position - accepted[camera]) > 1e-4 for camera, position in poses(real).items())
    press_and_confirm(page.get_by_role("button", name="Restore revision 2"))
    expect(page.get_by_text("poses of revision 2").first).to_be_visible()
    assert all((position == accepted[camera]).all() for camera, position in poses(real).items())
