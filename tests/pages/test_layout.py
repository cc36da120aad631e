"""Layout of pages: on a phone, of many cameras, and before their pictures are loaded."""

import itertools

import pytest
from playwright.sync_api import expect

from testbed.running import venue
from tests.pages.browsing import tab, wait_until
from tests.pages.newcomer import describe_a_camera

PHONE = {"width": 390, "height": 844}


@pytest.fixture
def phone(stub, people):
    with tab(people(stub.url)) as page:
        page.set_viewport_size(PHONE)
        yield page


def inside(page, part):
    """True if all of a part is visible without scrolling sideways."""
    box = part.bounding_box()
    return box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"]


@pytest.mark.long
def test_a_phone_shows_all_of_each_row_with_what_it_is(stored, phone):
    name = "small"
    job = stored.calibrated(name)
    phone.goto(f"/ui/venues/{name}")
    for section in ("Revisions of the poses", "Download the poses in use"):
        phone.locator("summary", has_text=section).click()
    for part in (
        phone.get_by_role("button", name="Restore revision 1"),
        phone.get_by_role("link", name="opencv, camera right"),
        phone.get_by_role("region", name="The last calibrations").get_by_role("link", name=job),
    ):
        assert inside(phone, part)
    cell = phone.locator("td[data-label='right since set']").first
    assert cell.evaluate("one => getComputedStyle(one, '::before').content") == '"right since set"'
    phone.goto(f"/ui/jobs?venue={name}")
    assert all(inside(phone, cell) for cell in phone.locator("tbody td").all())


def test_a_phone_folds_what_is_not_needed_first_and_the_address_opens_it(stored, phone):
    name = "folded"
    stored.calibrated(name)
    phone.goto(f"/ui/venues/{name}")
    restore, cron = phone.get_by_role("button", name="Restore revision 1"), phone.get_by_label("Cron schedule")
    for hidden in (restore, cron):
        expect(hidden).to_be_hidden()
    for shown in ("Accepted", "Cameras", "History"):
        expect(phone.get_by_text(shown, exact=True).first).to_be_visible()
    phone.evaluate("location.hash = 'revisions'")
    expect(restore).to_be_visible()
    phone.set_viewport_size({"width": 1280, "height": 860})
    expect(cron).to_be_visible()
    phone.set_viewport_size(PHONE)
    phone.goto("about:blank")
    phone.goto(f"/ui/venues/{name}#schedule")
    expect(cron).to_be_visible()
    expect(restore).to_be_hidden()


@pytest.mark.long
def test_what_a_phone_has_folded_stays_folded_while_the_page_follows_what_happens(stored, phone):
    name = "unfolded"
    stored.calibrated(name)
    phone.goto(f"/ui/venues/{name}")
    phone.locator("summary", has_text="Download the poses in use").click()
    stored.calibrated(name)
    expect(phone.locator("[data-part=history] tbody tr:has(.badge)")).to_have_count(2)
    expect(phone.get_by_role("button", name="Restore revision 1")).to_be_hidden()
    expect(phone.get_by_role("link", name="opencv, camera right")).to_be_visible()


@pytest.mark.long
def test_the_magnification_and_its_list_stand_on_one_row_of_a_phone(real, visit):
    page = visit(real, "/ui/venues/newcomer", size=(390, 844))
    label, choice = page.locator("label[for=times]"), page.locator("#times")
    choice.wait_for()
    tops = [one.bounding_box() for one in (label, choice)]
    middles = [box["y"] + box["height"] / 2 for box in tops]
    assert abs(middles[0] - middles[1]) < 5


@pytest.mark.long
def test_pictures_have_their_height_before_they_are_there(stub, visit):
    stub.http.put("/venues/waiting", json=venue("waiting", cameras=("left", "right"))).raise_for_status()
    stub.calibrated("waiting")
    page = visit(stub.url)
    page.route("**/overlay/*.jpg", lambda route: None)
    page.goto("/ui/venues/waiting", wait_until="domcontentloaded")
    box = page.locator(".layers img").first.bounding_box()
    assert box["height"] == pytest.approx(box["width"] * 48 / 64, abs=2)


@pytest.mark.long
def test_the_magnifier_begins_on_a_line_of_the_field(real, visit):
    page = visit(real, "/ui/venues/newcomer")
    page.locator(".loupe").wait_for()
    wait_until(page, "document.querySelector('#loupe-after').getContext('2d').getImageData(0, 0, 1, 1).data[3] === 255")
    bright, green = page.evaluate(
        """() => {
            const canvas = document.querySelector("#loupe-after");
            const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            let bright = 0;
            let green = 0;
            for (let at = 0; at < data.length; at += 4) {
                const [r, g, b] = data.slice(at, at + 3);
                if (Math.min(r, g, b) > 140) bright += 1;
                // Grass, which is lit; not trees.
                if (g > r && g > b && g > 90) green += 1;
            }
            return [bright, green].map((count) => (4 * count) / data.length);
        }"""
    )
    assert 0.01 < bright < 0.5
    assert green > 0.7


@pytest.mark.long
def test_the_stitched_view_says_that_it_is_being_drawn(real, visit):
    page = visit(real)
    page.route("**/stitch/preview?*", lambda route: None)
    page.goto("/ui/venues/newcomer#view")
    page.locator("#view-picture").scroll_into_view_if_needed()
    expect(page.get_by_text("The view is being drawn")).to_be_visible()
    page.unroute_all()
    page.goto("/ui/venues/newcomer#view")
    page.locator("#view-picture").scroll_into_view_if_needed()
    expect(page.get_by_text("The view is being drawn")).to_be_hidden()


@pytest.mark.long
@pytest.mark.parametrize("sport", ["football", "tennis", "basketball"])
def test_points_of_a_plan_lie_apart_and_each_can_be_picked(stub, visit, sport):
    page = visit(stub.url, "/ui/new-venue/by-hand")
    page.get_by_label("Sport").select_option(sport)
    describe_a_camera(page, 0)
    plan = page.locator("[data-plan]")
    plan.scroll_into_view_if_needed()
    circles = plan.locator("circle").evaluate_all(
        "all => all.map((one) => [one.cx.baseVal.value, one.cy.baseVal.value, one.r.baseVal.value, one.textContent])"
    )
    assert len(circles) > 10
    for (x, y, r, _), (u, v, s, _) in itertools.combinations(circles, 2):
        assert (x, y) == (u, v) or ((x - u) ** 2 + (y - v) ** 2) ** 0.5 > r + s
    for word in ("near", "far", "left", "right"):
        expect(plan.get_by_text(word, exact=True)).to_have_count(1)
    *_, name = circles[3]
    middle = plan.locator("circle").nth(3).bounding_box()
    page.mouse.click(middle["x"] + middle["width"] / 2, middle["y"] + middle["height"] / 2)
    expect(page.locator("[data-point]")).to_have_value(name)


@pytest.mark.long
def test_a_pose_that_one_point_contradicts_is_not_called_good(stub, visit):
    page = visit(stub.url, "/ui/new-venue/by-hand")
    points = [{"residual_px": 0.7, "looks_like": None, "doubted": doubted} for doubted in (False, False, False, True)]
    answer = {
        "result": {
            "accepted": True, "rms_px": 1.7, "points": points, "lens": None,
            "pose": {"rotation": [1, 0, 0], "position": [0, -50, 8]}, "intrinsics": {},
        },
        "error": None, "expected": [None] * 4, "lines": [],
    }  # fmt: skip
    page.route("**/ui/new-venue/pose", lambda route: route.fulfill(json=answer))
    describe_a_camera(page, 0)
    frame = page.locator("canvas[data-frame]")
    names = page.locator("[data-point] option").all_inner_texts()[:4]
    for number, name in enumerate(names):
        page.locator("[data-point]").select_option(name)
        frame.click(position={"x": 50 + 60 * number, "y": 80})
    verdict = page.locator("[data-verdict]")
    expect(verdict).to_contain_text(f"but not {names[3]}")
    expect(verdict).not_to_contain_text("Good")
    expect(verdict).to_have_class("note")
