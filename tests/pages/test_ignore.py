"""Areas of a frame that are to be ignored, drawn by hand."""

import pytest
from playwright.sync_api import expect

from testbed.running import png
from tests.pages.browsing import grave, look


@pytest.fixture
def page(stub, visit, tmp_path):
    """The page of a venue that was never calibrated, with a frame of its left camera."""
    stub.venue("railing")
    frame = tmp_path / "left.png"
    frame.write_bytes(png())
    page = visit(stub.url, "/ui/venues/railing/ignore")
    page.locator("[data-camera=left] input[type=file]").set_input_files(frame)
    return page


def ignored(stub):
    return [camera["ignore"] for camera in stub.http.get("/venues/railing").json()["cameras"]]


def click(page, *shares):
    """Click places of the left frame, as shares of its width and height."""
    frame = page.locator("[data-camera=left] .sighting")
    box = frame.bounding_box()
    for x, y in shares:
        frame.click(position={"x": x * box["width"], "y": y * box["height"]})


def test_an_area_is_clicked_corner_by_corner_and_saved_with_the_venue(stub, page):
    save = page.get_by_role("button", name="Save")
    expect(save).to_be_disabled()
    click(page, (0.1, 0.5), (0.9, 0.5), (0.9, 0.9), (0.1, 0.5))
    expect(page.locator("[data-camera=left] .areas li")).to_have_count(1)
    save.click()
    expect(page.get_by_text("Saved.")).to_be_visible()
    (area,), right = ignored(stub)
    assert len(area) == 3
    assert area[0] == pytest.approx([0.1 * 64 - 0.5, 0.5 * 48 - 0.5], abs=1)
    assert right == []


def test_what_was_saved_is_shown_again_and_can_be_removed(stub, page):
    left = {"ignore": [[[0, 0], [20, 0], [20, 20]]]}
    stub.http.patch(
        "/venues/railing",
        json={"cameras": {"left": left}},
        headers={"Content-Type": "application/merge-patch+json"},
    ).raise_for_status()
    page.reload()
    page.get_by_role("button", name="Remove area 1 of camera left").click()
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Saved.")).to_be_visible()
    assert ignored(stub) == [[], []]


def test_an_area_is_drawn_by_keys_alone(page):
    frame = page.locator("[data-camera=left] .sighting")
    frame.focus()
    before = look(frame)
    for key in ("Space", "ArrowRight", "Space", "ArrowDown", "Space", "Enter"):
        frame.press(key)
    expect(page.locator("[data-camera=left] .areas li")).to_have_text("3 corners Remove")
    assert (look(frame) != before).any()


@pytest.mark.long
def test_everybody_can_use_it(page):
    assert grave(page) == []
