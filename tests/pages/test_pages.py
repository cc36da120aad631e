"""Every page on a service whose venues' names say how their jobs end."""

import re

import pytest
from playwright.sync_api import expect

from testbed import running
from testbed.parameters import try_first
from testbed.running import SIZE, png, wait_for
from tests.pages.browsing import differs, grave, list_from, look, press_and_confirm, tab, wait_until
from tests.pages.reading import shown_at, words_of
from tests.pages.stocked import calibrations

DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 800}


@pytest.fixture(scope="package")
def years(stub):
    """A venue with calibrations enough for a chart."""
    stub.venue("years")
    with stub.database() as connection:
        calibrations(connection, "years", 60)
    return "years"


@pytest.fixture(scope="package")
def ended(stub):
    """A job that was accepted, and one that was rejected."""
    return {
        name: stub.calibrated(stub.venue(name, behaviour))
        for name, behaviour in (("fine", "accept"), ("poor", "reject"), ("broken", "fail"))
    }


@pytest.fixture
def frames(tmp_path):
    """A file of each camera that fits, and one that does not."""

    def file(name, **size):
        path = tmp_path / f"{name}.png"
        path.write_bytes(png(**size))
        return path

    return {"left": file("left"), "right": file("right"), "wide": file("wide", width=2 * SIZE[0])}


@pytest.fixture(scope="module")
def one_tab(stub, people):
    """A tab in which page after page is looked at: to open one costs more than to look."""
    with tab(people(stub.url)) as page:
        yield page


def test_the_list_shows_each_venue_with_its_last_result(stub, ended, years, visit):
    for venue, says in (("fine", "Accepted"), ("poor", "Rejected"), ("broken", "Failed")):
        page = visit(stub.url, list_from(venue))
        row = page.locator(".venue-row", has=page.locator(f"a[href='/ui/venues/{venue}']"))
        expect(row.locator(".badge")).to_have_text(says)
        # Whatever a calibration found: none that was refused has moved a camera.
        expect(row.locator("dd").last).to_have_text("1.00 px" if says == "Accepted" else "–")
    page = visit(stub.url, list_from("years"))
    row = page.locator(".venue-row", has=page.locator("a[href='/ui/venues/years']"))
    expect(row.get_by_role("img", name="Stitch error")).to_be_visible()


@pytest.mark.parametrize(
    ("accepted", "decision", "says"), try_first([(True, "reject", "Undone"), (False, "accept", "Accepted by hand")])
)
def test_the_list_says_what_was_decided_since_the_last_calibration(stub, stored, visit, accepted, decision, says):
    name = f"decided-{decision}"
    job = stored.calibrated(name, accepted=accepted)
    stub.http.post(f"/jobs/{job}/{decision}").raise_for_status()
    page = visit(stub.url, list_from(name))
    row = page.locator(".venue-row", has=page.locator(f"a[href='/ui/venues/{name}']"))
    expect(row.locator(".badge")).to_have_text(says)
    stored.calibrated(name, accepted=accepted, dry_run=True)
    expect(row.locator(".badge")).to_have_text("Accepted, dry run" if accepted else "Rejected")


def test_the_list_of_jobs_begins_with_venue_and_time(stub, stored):
    job = stored.calibrated("in-a-row")
    shown = shown_at(stub, "/ui/jobs?venue=in-a-row")
    heads = [words_of(head) for head in re.findall(r"<th.*?</th>", shown, re.DOTALL)]
    assert heads == ["Venue", "Submitted", "Kind", "State", "Took", "Stitch error", "Job"]
    assert re.search(rf'<a href="/ui/jobs/{job}"[^>]*>\s*Calibration', shown)


def test_a_rejected_result_is_accepted_by_hand(stub, ended, visit):
    page = visit(stub.url, "/ui/venues/poor")
    reasons = page.locator(".verdict .reason li")
    expect(reasons).to_have_text([f"{camera}: the lines do not fit" for camera in ("left", "right")])
    expect(page.get_by_text("In use: revision 1 (set by hand)")).to_be_visible()
    anyway = page.get_by_role("button", name="Accept anyway")
    # Nobody is invited to it.
    expect(anyway).to_have_class("quiet")
    press_and_confirm(anyway)
    expect(page.get_by_text("These poses are in use")).to_be_visible()
    assert stub.http.get("/venues/poor").json()["cameras"][0]["pose"]["position"][0] == -0.875


def test_a_result_that_is_accepted_in_part_says_of_which_camera_and_the_rest_can_be_taken(stub, stored, visit):
    job = stub.job(stored.calibrated("part", accepted=["left"]))
    page = visit(stub.url, "/ui/venues/part")
    expect(page.locator(".verdict-big")).to_have_text(re.compile("Partly accepted"))
    expect(page.get_by_text("Those that were accepted are in use")).to_be_visible()
    left, right = (page.get_by_role("article", name=camera) for camera in ("left", "right"))
    expect(left.locator(".badge")).to_have_text("Accepted")
    expect(right.locator(".badge")).to_have_text("Rejected")
    expect(right.get_by_text("the lines do not fit")).to_be_visible()
    assert stub.http.get("/venues/part").json()["cameras"][1]["pose"] != job["result"]["cameras"][1]["pose"]
    press_and_confirm(right.get_by_role("button", name="Accept right anyway"))
    expect(page.get_by_text("as revision 3")).to_be_visible()
    expect(page.get_by_role("button", name="anyway")).to_have_count(0)
    assert stub.http.get("/venues/part").json()["cameras"][1]["pose"] == job["result"]["cameras"][1]["pose"]


def test_the_chart_has_the_results_the_movements_and_the_line_of_the_gate(stub, years, visit):
    page = visit(stub.url, "/ui/venues/years")
    chart = page.locator("#chart canvas")
    chart.wait_for()
    drawn = look(chart)
    history = page.evaluate("fetch('/ui/venues/years/history.json').then((answer) => answer.json())")
    assert len(history["at"]) == 60
    for name in ("Gate", "Stitch error", "left moved"):
        page.locator(".u-series", has_text=name).locator("th").click()
        without = look(chart)
        assert differs(drawn, without) > 0.001, name
        drawn = without
    page.get_by_label("Logarithmic").check()
    wait_until(page, "document.querySelectorAll('#chart canvas').length === 1")
    assert differs(drawn, look(page.locator("#chart canvas"))) > 0.005


def test_frames_are_looked_at_before_they_travel(stub, frames, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('sent', 'accept')}/calibrate")
    send = page.get_by_role("button", name="Calibrate")
    left, right = (page.locator(f"[data-camera={camera}] input[type=file]") for camera in ("left", "right"))
    left.set_input_files(frames["wide"])
    expect(page.get_by_text("wide.png has 128 × 48 pixels; this camera takes 64 × 48")).to_be_visible()
    left.set_input_files(frames["left"])
    expect(page.get_by_role("img", name="left.png")).to_be_visible()
    expect(send).to_be_disabled()
    right.set_input_files([frames["right"], frames["right"]])
    page.locator("summary").click()
    page.get_by_label("Dry run").check()
    page.get_by_label("Seed").fill("11")
    send.click()
    page.wait_for_url("**/ui/jobs/*")
    expect(page.locator(".title .badge")).to_have_text("Accepted, dry run")
    job = stub.job(page.url.rpartition("/")[2])
    options = job["result"]["provenance"]["options"]
    assert (options["dry_run"], options["seed"]) == (True, 11)
    assert job["venue_revision"] is None


def test_frames_that_were_chosen_before_the_script_came_are_taken(stub, frames, visit):
    page = visit(stub.url, "/")
    held = []
    page.route("**/frameform.js", lambda route: held.append(route))
    page.goto(f"{stub.url}/ui/venues/{stub.venue('early', 'accept')}/calibrate", wait_until="commit")
    for camera in ("left", "right"):
        page.locator(f"[data-camera={camera}] input[type=file]").set_input_files(frames[camera])
    held[0].continue_()
    for camera in ("left", "right"):
        expect(page.get_by_role("img", name=f"{camera}.png")).to_be_visible()
    expect(page.get_by_role("button", name="Calibrate")).to_be_enabled()


def test_a_frame_that_was_chosen_can_be_taken_away_again(stub, frames, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('sent', 'accept')}/calibrate")
    page.locator("[data-camera=left] input[type=file]").set_input_files(frames["left"])
    page.get_by_role("button", name="Remove left.png").click()
    expect(page.get_by_text("No frame yet of left, right")).to_be_visible()


def test_frames_dropped_on_the_page_find_their_cameras_by_their_names(stub, frames, visit):
    page = visit(stub.url, f"/ui/venues/{stub.venue('sent', 'accept')}/calibrate")
    bytes_ = list(frames["left"].read_bytes())
    page.evaluate(
        """(bytes) => {
            const dropped = new DataTransfer();
            for (const name of ["ground-left.png", "ground-right.png"]) {
                dropped.items.add(new File([new Uint8Array(bytes)], name, {type: "image/png"}));
            }
            document.dispatchEvent(new DragEvent("drop", {dataTransfer: dropped, cancelable: true}));
        }""",
        bytes_,
    )
    for camera in ("left", "right"):
        expect(page.locator(f"[data-camera={camera}]").get_by_role("img", name=f"ground-{camera}.png")).to_be_visible()


def test_what_the_service_refuses_is_said_where_it_was_asked(stub, frames, visit):
    venue = stub.venue("busy-page", "hang")
    first = stub.submitted(venue)
    page = visit(stub.url, f"/ui/venues/{venue}/calibrate", forgiven=("409",))
    for camera in ("left", "right"):
        page.locator(f"[data-camera={camera}] input[type=file]").set_input_files(frames[camera])
    page.locator("summary").click()
    page.get_by_label("Dry run").check()
    page.get_by_role("button", name="Calibrate").click()
    expect(page.locator("#refused")).to_contain_text(f"Wait for job {first}")
    stub.http.post(f"/jobs/{first}/cancel")


def test_a_running_job_is_followed_and_cancelled(stub, visit):
    job = stub.submitted(stub.venue("followed", "accept 60"))
    stub.running(job)
    page = visit(stub.url, f"/ui/jobs/{job}")
    expect(page.locator(".stages [aria-current]")).to_have_text("evolution")
    expect(page.locator("progress")).to_have_attribute("value", "0.5")
    expect(page.locator("[data-live=loss] canvas")).to_be_visible()
    press_and_confirm(page.get_by_role("button", name="Cancel"))
    expect(page.locator(".title .badge")).to_have_text("Cancelled")
    page.goto("/ui/venues/followed")
    expect(page.locator(".verdict-big")).to_have_text(re.compile("Cancelled"))


def test_a_job_is_run_again_with_the_same_frames(stub, ended, visit):
    page = visit(stub.url, f"/ui/jobs/{ended['fine']['id']}")
    page.get_by_role("button", name="Again").click()
    page.wait_for_url(lambda url: "/ui/jobs/" in url and ended["fine"]["id"] not in url)
    again = stub.end(page.url.rpartition("/")[2])
    seeds = [job["result"]["provenance"]["seed"] for job in (ended["fine"], again)]
    assert seeds[0] == seeds[1]
    assert again["status"] == "succeeded"


def test_jobs_are_filtered(stub, ended, visit):
    page = visit(stub.url, "/ui/jobs")
    page.get_by_label("Venue").fill("broken")
    page.get_by_label("Status").select_option("failed")
    page.get_by_role("button", name="Filter").click()
    expect(page.locator("tbody tr")).to_have_count(1)
    expect(page.locator("tbody tr")).to_contain_text("Failed")
    page.get_by_label("Status").select_option("succeeded")
    page.get_by_role("button", name="Filter").click()
    expect(page.get_by_role("heading", name="No jobs like that")).to_be_visible()


def test_the_list_of_jobs_follows_what_happens(stub, visit):
    job = stub.submitted(stub.venue("listed", "accept 60"))
    stub.running(job)
    page = visit(stub.url, "/ui/jobs?venue=listed")
    expect(page.locator("tbody .badge")).to_have_text("Running")
    stub.http.post(f"/jobs/{job}/cancel")
    expect(page.locator("tbody .badge")).to_have_text("Cancelled")


def test_names_that_are_markup_are_text(stub):
    name = "<img src=x onerror=alert(1)>"
    stub.http.put("/venues/markup", json=running.venue("markup", name))
    shown = shown_at(stub, "/ui/venues/markup")
    assert name not in shown
    assert name in words_of(re.search(r"<h1.*?</h1>", shown, re.DOTALL)[0])


PAGES = {
    "venues": "/",
    "venue": "/ui/venues/years",
    "venue-with-pictures": "/ui/venues/fine",
    "venue-without": "/ui/venues/bare",
    "calibrate": "/ui/venues/years/calibrate",
    "jobs": "/ui/jobs",
    "no-jobs": "/ui/jobs?venue=none",
    "job": "/ui/jobs/{job}",
    "failed-job": "/ui/jobs/{failed}",
    "plan": "/ui/plan",
    "new-venue": "/ui/new-venue",
    "new-venue-by-hand": "/ui/new-venue/by-hand",
    "find": "/ui/venues/years/find",
    "settings": "/ui/venues/bare/settings",
    "first-pose": "/ui/venues/bare/first-pose",
    "document": "/ui/documents/refused",
}


@pytest.mark.parametrize("name", try_first(PAGES))
def test_nothing_serious_keeps_anybody_from_using_a_page_and_it_fits_a_phone(stub, years, ended, one_tab, name):
    stub.venue("bare")
    one_tab.set_viewport_size(DESK)
    one_tab.goto(PAGES[name].format(job=ended["fine"]["id"], failed=ended["broken"]["id"]))
    one_tab.wait_for_load_state("networkidle")
    assert grave(one_tab) == []
    one_tab.set_viewport_size(PHONE)
    # Charts follow the width of the page a moment later.
    wait_until(one_tab, f"document.documentElement.scrollWidth <= {PHONE['width']}")


def test_the_keyboard_reaches_what_a_page_offers(stub, ended, visit):
    page = visit(stub.url, "/ui/venues/fine")
    offered = {"Skip to the content", "Venues", "Jobs", "Calibrate", "Undo"}
    for _ in range(40):
        page.keyboard.press("Tab")
        offered.discard(page.evaluate("document.activeElement.textContent.trim() || document.activeElement.name"))
        if not offered:
            break
    assert not offered


def test_a_job_that_failed_shows_its_frames_with_what_was_wrong_and_what_was_asked(stub, ended, visit):
    page = visit(stub.url, f"/ui/jobs/{ended['broken']['id']}")
    left, right = (page.get_by_role("article", name=camera) for camera in ("left", "right"))
    expect(left.get_by_text("It is black.")).to_be_visible()
    expect(right.get_by_text("It is black.")).to_have_count(0)
    pictures = [camera.get_by_role("img") for camera in (left, right)]
    wait_for(lambda: {picture.evaluate("(img) => img.naturalWidth") for picture in pictures} == {SIZE[0]})
    asked = page.get_by_role("region", name="What was asked")
    expect(asked.get_by_text("somebody without a key")).to_be_visible()
    expect(asked.get_by_text("left, right")).to_be_visible()
    expect(asked.get_by_text(str(ended["broken"]["options"]["seed"]))).to_be_visible()
