"""Pages that stay right by themselves: a venue by its events, lists by asking again."""

import re
import time

import pytest
from playwright.sync_api import expect

from testbed.running import Service, venue
from testbed.stock import Stock
from tests.pages.browsing import in_each_scheme, list_from, wait_until

# While a service is away, a browser says so at each try; and of what it was loading when the service was killed.
AWAY = (
    "ERR_CONNECTION_REFUSED",
    "ERR_INCOMPLETE_CHUNKED_ENCODING",
    "ERR_CONTENT_LENGTH_MISMATCH",
    "ERR_EMPTY_RESPONSE",
    "ERR_CONNECTION_RESET",
)
HIDE = """hidden => {
    Object.defineProperty(document, "hidden", {configurable: true, get: () => hidden});
    document.dispatchEvent(new Event("visibilitychange"));
}"""


@pytest.fixture
def open_venue(stub, visit):
    """Opens the page of a venue; in the end it must be the page that was opened, never loaded again."""
    opened = []

    def open_venue(name, behaviour="accept", **parts):
        stub.http.put(f"/venues/{name}", json=venue(name, behaviour) | parts).raise_for_status()
        page = visit(stub.url, f"/ui/venues/{name}")
        page.evaluate("window.opened = true")
        opened.append(page)
        return page

    yield open_venue
    assert all(page.evaluate("window.opened") for page in opened)


def test_the_page_of_a_venue_shows_a_new_job_its_end_and_its_revision(stub, open_venue):
    page = open_venue("watched")
    expect(page.get_by_role("heading", name="Not calibrated yet")).to_be_visible()
    with stub.jobs_held("watched"):
        job = stub.submitted("watched")
        going_on = page.get_by_role("region", name="The job that is going on")
        expect(going_on.locator(".badge")).to_have_text("Running")
        expect(going_on).to_contain_text("evolution")
        expect(page.get_by_role("link", name="Calibrate", exact=True)).to_have_count(0)
    stub.end(job)
    expect(page.locator(".verdict-big")).to_have_text(re.compile("Accepted"))
    expect(going_on).to_have_count(0)
    expect(page.get_by_role("region", name="The last calibrations").get_by_role("link", name=job)).to_be_visible()
    expect(page.get_by_role("button", name="Restore revision 1")).to_be_visible()
    expect(page.locator("#chart canvas")).to_be_visible()


def test_the_page_of_a_venue_shows_alarms_and_what_others_change(stub, open_venue):
    page = open_venue("ringing", "reject", alarms={"rejected_in_a_row": 1})
    stub.end(stub.submitted("ringing"))
    expect(page.locator(".problem", has_text="rejected")).to_be_visible()
    stub.http.patch("/venues/ringing", json={"name": "North pitch"}).raise_for_status()
    expect(page.get_by_role("heading", level=1)).to_have_text("North pitch")


def test_a_form_that_somebody_fills_in_is_left_alone_and_cannot_undo_what_others_changed(stub, open_venue):
    page = open_venue("edited")
    page.locator("summary", has_text="Stitched view for other tools").click()
    page.get_by_label("Pan to the right, °", exact=True).fill("7")
    stub.http.patch("/venues/edited", json={"name": "Changed", "view": {"pan_deg": 3}}).raise_for_status()
    expect(page.get_by_role("heading", level=1)).to_have_text("Changed")
    expect(page.get_by_label("Pan to the right, °", exact=True)).to_have_value("7")
    assert (
        page.evaluate("document.querySelector('[data-tag]').dataset.tag")
        != stub.http.get("/venues/edited").headers["etag"]
    )


def test_a_switch_and_the_focus_stay_where_they_are_when_a_part_is_shown_anew(stored, open_venue):
    page = open_venue("focused")
    stored.calibrated("focused")
    page.get_by_label("Logarithmic").check()
    page.get_by_role("link", name="All jobs of this venue").focus()
    stored.calibrated("focused")
    expect(page.get_by_role("region", name="The last calibrations").locator("tbody tr")).to_have_count(2)
    expect(page.get_by_label("Logarithmic")).to_be_checked()
    wait_until(page, "document.activeElement.tagName === 'A'")


@pytest.mark.long
def test_pages_say_that_the_service_is_away_and_go_on_when_it_is_back(tmp_path, visit):
    service = Service(tmp_path / "coming-back", "serve")
    service.venue("patient")
    pages = [visit(service.url, path, forgiven=AWAY) for path in ("/", "/ui/jobs", "/ui/venues/patient")]
    hints = [page.get_by_text("The service does not answer.") for page in pages]
    for hint in hints:
        expect(hint).to_be_hidden()
    assert service.stop() == 0
    for hint in hints:
        expect(hint).to_be_visible(timeout=20_000)
    service.start(int(service.url.rpartition(":")[2]))
    for hint in hints:
        expect(hint).to_be_hidden(timeout=20_000)
    stock = Stock(service.data)
    stock.calibrated("patient")
    stock.engine.dispose()
    expect(pages[2].locator(".verdict-big")).to_have_text(re.compile("Accepted"))
    service.kill()


def test_a_hidden_page_holds_no_connection_and_a_page_in_sight_catches_up(tmp_path, visit):
    service = Service(tmp_path / "one-place", "serve", ESC_FOLLOWERS="1")
    service.venue("shared")
    first = visit(service.url, "/ui/venues/shared", forgiven=(" 503 ",))
    first.evaluate(HIDE, True)
    # The one place there is was given back: or this page would not hear of the change. Until the service notices that
    # the first page has let go, it refuses the second one, which asks again.
    second = visit(service.url, "/ui/venues/shared", forgiven=(" 503 ",))
    service.http.patch("/venues/shared", json={"name": "Seen by one"}).raise_for_status()
    expect(second.get_by_role("heading", level=1)).to_have_text("Seen by one")
    second.close()
    assert first.get_by_role("heading", level=1).inner_text() == "accept"
    first.evaluate(HIDE, False)
    expect(first.get_by_role("heading", level=1)).to_have_text("Seen by one")
    first.close()
    service.kill()


@pytest.mark.long
def test_what_waits_and_what_runs_are_pills_like_other_states_and_named_alike_all_over_a_page(stub, stored, visit):
    stored.calibrated("pill")
    job = stub.submitted(stub.venue("pills", "accept 60"))
    stub.running(job)
    list_of_jobs = visit(stub.url, "/ui/jobs")
    page = visit(stub.url, f"/ui/jobs/{job}")
    badges = page.locator(".badge")
    expect(badges).to_have_text(["Running", "Running"])
    for _ in zip(in_each_scheme(list_of_jobs), in_each_scheme(page), strict=True):
        heights = {
            state: list_of_jobs.locator("tbody .badge", has_text=state).first.bounding_box()["height"]
            for state in ("Running", "Accepted")
        }
        assert heights["Running"] == heights["Accepted"]
        boxes = [badges.nth(number).bounding_box() for number in (0, 1)]
        assert {box["height"] for box in boxes} == {heights["Accepted"]}
    stub.http.post(f"/jobs/{job}/cancel")


@pytest.mark.long
def test_the_head_of_a_job_that_begins_says_so_as_the_panel_below_does(stub, visit):
    before = stub.submitted(stub.venue("ahead", "accept 60"))
    stub.running(before)
    job = stub.submitted(stub.venue("behind", "accept 60"))
    page = visit(stub.url, f"/ui/jobs/{job}")
    expect(page.locator(".badge")).to_have_text(["Queued", "Queued"])
    stub.http.post(f"/jobs/{before}/cancel")
    expect(page.locator(".badge")).to_have_text(["Running", "Running"])
    stub.http.post(f"/jobs/{job}/cancel")


@pytest.mark.long
def test_a_link_that_is_clicked_as_a_job_ends_is_followed(stub, visit):
    job = stub.submitted(stub.venue("left-behind", "accept 60"))
    stub.running(job)
    page = visit(stub.url, f"/ui/jobs/{job}")
    expect(page.locator(".badge")).to_have_text(["Running", "Running"])

    def answer_after_the_end(route):
        stub.http.post(f"/jobs/{job}/cancel").raise_for_status()
        stub.end(job)
        # Meanwhile the page hears of the end.
        time.sleep(2)
        route.continue_()

    page.route("**/ui/venues/left-behind", answer_after_the_end)
    page.locator("a[href$='/ui/venues/left-behind']").first.click()
    expect(page).to_have_url(re.compile("/ui/venues/left-behind$"))


@pytest.mark.long
def test_a_job_shows_its_end_on_a_page_that_a_download_was_begun_from(stub, visit):
    job = stub.submitted(stub.venue("downloaded", "accept 60"))
    stub.running(job)
    page = visit(stub.url, f"/ui/jobs/{job}")
    expect(page.locator(".badge")).to_have_text(["Running", "Running"])
    # Browsers send it for a download as well, and the page stays.
    page.evaluate("window.dispatchEvent(new Event('beforeunload'))")
    stub.http.post(f"/jobs/{job}/cancel").raise_for_status()
    expect(page.locator(".badge").first).to_have_text("Cancelled")


@pytest.mark.long
def test_the_list_of_venues_goes_on_while_a_link_of_it_has_the_focus(stub, stored, visit):
    stub.venue("chosen")
    page = visit(stub.url, list_from("chosen"))
    page.locator("a[href='/ui/venues/chosen']").focus()
    stored.calibrated("chosen")
    expect(page.locator(".venue-row", has=page.locator("a[href='/ui/venues/chosen']")).locator(".badge")).to_have_text(
        "Accepted"
    )
    expect(page.locator("a[href='/ui/venues/chosen']")).to_be_focused()
