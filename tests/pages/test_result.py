"""The pictures of a result do what their switches say: judged by pixels."""

import pytest
from playwright.sync_api import expect

from tests.pages.browsing import differs, look, tab, wait_until

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def one_tab(real, people):
    with tab(people(real)) as page:
        yield page


@pytest.fixture
def venue(one_tab):
    """The page of the venue, loaded anew."""
    # Where no pointer of the test before is over a picture.
    one_tab.mouse.move(0, 0)
    one_tab.goto("/ui/venues/newcomer")
    one_tab.locator(".loupe").wait_for()
    return one_tab


def test_the_slider_shows_the_stored_poses_on_its_left_and_the_new_ones_on_its_right(venue):
    slider = venue.get_by_role("slider", name="Stored poses")
    picture = venue.locator(".compare")
    venue.locator(".reticle").evaluate("one => one.hidden = true")

    def moved_to(key, value):
        slider.press(key)
        expect(slider).to_have_attribute("aria-valuenow", value)
        # The library glides.
        wait_until(venue, "!document.querySelector('img-comparison-slider').shadowRoot.getAnimations().length")
        return look(picture)

    half = look(picture)
    new, stored = moved_to("Home", "0"), moved_to("End", "100")
    middle, right = half.shape[1] // 2, slice(half.shape[1] // 2 + 60, -80)
    assert differs(new, stored) > 0.01
    assert differs(half[:, 80 : middle - 60], stored[:, 80 : middle - 60]) < 0.001
    assert differs(half[:, right], new[:, right]) < 0.001


def test_a_drag_moves_the_slider(venue):
    slider = venue.get_by_role("slider", name="Stored poses")
    box = slider.bounding_box()
    y = box["y"] + box["height"] / 2
    venue.mouse.move(box["x"] + box["width"] / 2, y)
    venue.mouse.down()
    venue.mouse.move(box["x"] + box["width"] / 4, y)
    venue.mouse.up()
    expect(slider).to_have_attribute("aria-valuenow", "25")


def test_the_seam_is_drawn_where_it_is_asked_for(venue):
    picture = venue.locator(".compare")
    without = look(picture)
    venue.get_by_label("Seam", exact=True).check()
    shown = look(picture)
    # A line, not an area.
    assert 0.0001 < differs(without, shown) < 0.02


def test_the_magnifier_goes_along_the_seam_and_shows_both(venue):
    before, after = venue.locator("#loupe-before"), venue.locator("#loupe-after")
    middle = look(before), look(after)
    assert differs(*middle) > 0.02
    venue.get_by_label("Magnifier along the seam").fill("200")
    assert differs(middle[0], look(before)) > 0.2
    assert differs(middle[1], look(after)) > 0.2


def test_the_magnifier_enlarges_by_as_much_as_is_chosen_and_follows_the_pointer(venue):
    after, reticle = venue.locator("#loupe-after"), venue.locator(".reticle")
    picture, width = look(after), reticle.bounding_box()["width"]
    venue.get_by_label("Magnification").select_option("8")
    assert reticle.bounding_box()["width"] == pytest.approx(width / 2, abs=3)
    assert differs(picture, look(after)) > 0.1
    enlarged = look(after)
    venue.locator(".compare").hover(position={"x": 200, "y": 150})
    assert differs(enlarged, look(after)) > 0.1


@pytest.mark.parametrize("name", ["New pose", "Stored pose", "Detected lines"])
def test_each_layer_is_drawn_on_each_frame_and_taken_off(venue, name):
    frames = venue.locator(".layers")
    for other in ("Stored pose", "New pose", "Detected lines"):
        venue.get_by_label(other, exact=True).uncheck()
    bare = [look(frames.nth(camera)) for camera in (0, 1)]
    venue.get_by_label(name, exact=True).check()
    drawn = [look(frames.nth(camera)) for camera in (0, 1)]
    venue.get_by_label(name, exact=True).uncheck()
    for camera in (0, 1):
        assert 0.001 < differs(bare[camera], drawn[camera]) < 0.2
        assert differs(bare[camera], look(frames.nth(camera))) < 0.0001


def test_what_was_seen_of_each_marking_is_listed_under_its_camera(venue):
    markings = venue.get_by_role("article", name="left").locator("details.markings")
    markings.locator("summary").click()
    circle = markings.get_by_role("row", name="centre circle")
    expect(circle).to_contain_text("%")
    expect(circle).to_contain_text("cm")


def test_the_seam_has_a_curve_whose_worst_place_is_red_where_its_uncertainty_does_not_explain_it(venue):
    seam = venue.get_by_role("region", name="Along the seam")
    expect(seam).to_contain_text("left and right: ")
    assert seam.locator("circle").count() > 4
    expect(seam.locator("circle.worst")).to_have_count(1 - seam.get_by_title("Within its uncertainty").count())


def test_every_format_is_offered_and_comes_as_a_file(venue):
    venue.locator("summary", has_text="Download the poses in use").click()
    with venue.expect_download() as saved:
        venue.get_by_role("link", name="opentrackio, all cameras").click()
    assert saved.value.suggested_filename == "newcomer-opentrackio.zip"
    with venue.expect_download() as saved:
        venue.get_by_role("link", name="freed, camera left").click()
    assert saved.value.suggested_filename == "newcomer-left-freed.d1"
