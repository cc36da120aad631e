"""Decisions about calibrations: pages offer those that are possible, and explain why others are not."""

import re

import pytest
import sqlalchemy as sa
from playwright.sync_api import expect

from service.store import tables
from testbed.running import venue
from tests.pages.browsing import press_and_confirm
from tests.pages.reading import shown_at, words_of


def moved_by_hand(stub, name):
    """Somebody stores another pose of the left camera."""
    pose = {"rotation": [1.6, 0.1, -0.2], "position": [-1.5, -50.0, 8.0]}
    stub.http.patch(f"/venues/{name}", json={"cameras": {"left": {"pose": pose}}}).raise_for_status()


ACCEPTED = {"accept": True, "reject": False, "partly": ["left"]}


@pytest.mark.parametrize("behaviour", ACCEPTED)
def test_poses_of_a_venue_that_was_changed_since_are_not_offered_and_the_way_out_is_said(stub, stored, behaviour):
    name = f"changed-{behaviour}"
    job = stored.calibrated(name, accepted=ACCEPTED[behaviour])
    moved_by_hand(stub, name)
    for path in (f"/ui/venues/{name}", f"/ui/jobs/{job}"):
        shown = shown_at(stub, path)
        (way_out,) = re.findall(r'<span class="dim">The venue was changed since.*?</span>', shown, re.DOTALL)
        assert re.findall(r"<a [^>]*>(.*?)</a>", way_out) == ["Calibrate" if behaviour == "reject" else "Revisions"]
        assert decisions_in(shown) == []


def test_a_calibration_that_moved_no_camera_offers_nothing_and_speaks_of_no_change_of_the_venue(stub):
    name = stub.venue("left-alone", "swapped")
    job = stub.calibrated(name)["id"]
    for address in (f"/ui/jobs/{job}", f"/ui/venues/{name}"):
        shown = shown_at(stub, address)
        assert "In use: revision 1 (set by hand)" in words_of(shown)
        assert "changed since" not in shown
        assert decisions_in(shown) == []


def decide(stub, name, job, steps):
    """Decide about a job, and about its venue, one after the other."""
    for step in steps.split():
        what, _, revision = step.partition("-")
        if what == "restore":
            stub.http.post(f"/venues/{name}/restore", json={"revision": int(revision)}).raise_for_status()
        elif what == "refine":
            stub.http.post(f"/venues/{name}/cameras/left/adopt-refined").raise_for_status()
        elif what == "put":
            moved_by_hand(stub, name)
        else:
            stub.http.post(f"/jobs/{job}/{'reject' if what == 'undo' else what}").raise_for_status()


@pytest.mark.parametrize(
    ("behaviour", "steps", "headline", "colour", "in_use", "buttons"),
    [
        ("accept", "", "Accepted", "good", "These poses are in use as revision 2", ["Undo"]),
        ("accept", "undo", "Undone", "plain", "In use: revision 3 (poses of revision 1)", ["Accept again"]),
        ("accept", "undo accept", "Accepted by hand", "good", "These poses are in use as revision 4", ["Undo"]),
        ("accept", "undo accept undo", "Undone", "plain", "In use: revision 5 (poses of revision 1)", ["Accept again"]),
        ("accept", "undo restore-2", "Accepted", "good", "as revision 4 (poses of revision 2)", []),
        ("accept", "undo restore-2 restore-3 restore-4", "Accepted", "good", "as revision 6 (poses of revision 2)", []),
        ("accept", "restore-1", "Undone", "plain", "In use: revision 3 (poses of revision 1)", ["Accept again"]),
        ("accept", "put", "Replaced", "plain", "In use: revision 3 (set by hand)", []),
        ("accept", "put restore-1", "Replaced", "plain", "In use: revision 4 (poses of revision 1)", ["Accept again"]),
        ("accept", "put restore-2", "Accepted", "good", "as revision 4 (poses of revision 2)", []),
        ("refine", "refine", "Replaced", "plain", "In use: revision 3 (refined lens stored)", []),
        ("reject", "", "Rejected", "bad", "In use: revision 1 (set by hand)", ["Accept anyway"]),
        ("reject", "accept", "Accepted by hand", "part", "These poses are in use as revision 2", ["Undo"]),
        ("reject", "accept undo", "Undone", "plain", "In use: revision 3 (poses of revision 1)", ["Accept anyway"]),
        ("reject", "put", "Rejected", "bad", "In use: revision 2 (set by hand)", []),
        ("partly", "", "Partly accepted", "part", "are in use as revision 2", ["Undo", "Accept all anyway"]),
        ("partly", "undo", "Undone", "plain", "In use: revision 3 (poses of revision 1)", ["Accept anyway"]),
        ("partly", "accept", "Accepted by hand", "part", "These poses are in use as revision 3", ["Undo"]),
        ("knock", "accept", "Accepted by hand", "part", "These poses are in use as revision 3", ["Undo"]),
        ("accept", "dry", "Accepted, dry run", "good", "In use: revision 1 (set by hand)", ["Accept"]),
        ("accept", "dry accept", "Accepted by hand", "good", "These poses are in use as revision 2", ["Undo"]),
        ("accept", "dry accept undo", "Undone", "plain", "In use: revision 3 (poses of revision 1)", ["Accept again"]),
    ],
)  # fmt: skip
def test_pages_say_what_became_of_a_calibration_and_offer_what_can_be_decided(
    stub, stored, behaviour, steps, headline, colour, in_use, buttons
):
    name, dry_run = f"sequence-{behaviour}-{steps.replace(' ', '-')}", steps.startswith("dry")
    if behaviour in ACCEPTED:
        job = stored.calibrated(name, accepted=ACCEPTED[behaviour], dry_run=dry_run)
    else:
        job = stub.calibrated(stub.venue(name, behaviour), dry_run=dry_run)["id"]
    decide(stub, name, job, steps.removeprefix("dry"))
    of_venue, of_job = shown_at(stub, f"/ui/venues/{name}"), shown_at(stub, f"/ui/jobs/{job}")
    for shown in (of_venue, of_job):
        assert in_use in words_of(shown)
        assert decisions_in(shown) == buttons
        is_lost = headline != "Accepted" and not buttons
        assert ("cannot be accepted any more" in shown) == is_lost
    assert f'<section class="verdict {colour}"' in of_venue
    assert words_of(re.search(r'<p class="verdict-big">.*?</p>', of_venue, re.DOTALL)[0]) == headline
    badge = re.search(r'<div class="title">.*?<span class="(badge[^"]*)"[^>]*>(.*?)</span>', of_job, re.DOTALL)
    assert badge[1].split() == ["badge", *([] if colour == "plain" else [colour])]
    assert words_of(badge[2]) == headline


def decisions_in(shown):
    """The words of the buttons that accept or reject."""
    buttons = re.findall(r'<button[^>]* data-call="[^"]*/(?:accept|reject)"[^>]*>(.*?)</button>', shown, re.DOTALL)
    return [words_of(button) for button in buttons]


def test_what_was_restored_away_can_be_had_back_as_the_page_says(stub, stored, visit):
    name = "had-back"
    stored.calibrated(name)
    page = visit(stub.url, f"/ui/venues/{name}")
    press_and_confirm(page.get_by_role("button", name="Restore revision 1"))
    expect(page.get_by_text("In use: revision 3 (poses of revision 1)")).to_be_visible()
    # The poses are those that the calibration began with: it can be accepted after all.
    press_and_confirm(page.get_by_role("button", name="Accept again"))
    expect(page.get_by_text("These poses are in use as revision 4")).to_be_visible()


def test_a_ridge_that_the_lines_have_is_stored_after_a_question_that_says_what_changes(stub, visit):
    name = stub.venue("crowned", "contradict")
    job = stub.calibrated(name)["id"]
    page = visit(stub.url, f"/ui/jobs/{job}")
    contradicted = page.get_by_role("region", name="What the lines contradict")
    expect(contradicted).to_contain_text("It cannot be stored: football: 60 to 130 m, not 131.5.")
    asked = press_and_confirm(contradicted.get_by_role("button", name="Store a ridge 0.332 m high"))
    expect(contradicted.get_by_role("button")).to_have_count(0)
    assert stub.http.get(f"/venues/{name}").json()["field"]["ridge"][0] == [-18.5, 0.0, 0.332]
    assert asked == (
        "Store a ridge 0.332 m high instead of 0.000 m? The lines are sure of it to ± 5.10 cm. The next calibration "
        "will move left by about 8.10 cm and right by about 7.90 cm. What the cameras remember of "
        "earlier nights ends. Restoring a revision takes it back."
    )
    page.goto(f"{stub.url}/ui/venues/{name}")
    expect(page.get_by_text("ridge 0.000 → 0.332 m")).to_be_visible()
    press_and_confirm(page.get_by_role("button", name="Restore revision 2"))
    expect(page.get_by_role("cell", name="poses of revision 2")).to_be_visible()
    assert stub.http.get(f"/venues/{name}").json()["field"]["ridge"] is None


def test_a_revision_of_other_cameras_is_not_offered(stub):
    name = stub.venue("grown")
    stub.http.put(f"/venues/{name}", json=venue(name, cameras=("left", "middle", "right"))).raise_for_status()
    shown = shown_at(stub, f"/ui/venues/{name}")
    assert "of other cameras or another pitch" in words_of(shown)
    assert "Restore revision 1" not in shown


def test_a_job_whose_frames_do_not_fit_any_more_is_not_offered_again(stub, stored):
    path = f"/ui/jobs/{stored.calibrated('refitted')}"
    assert "Again</button>" in shown_at(stub, path)
    stub.http.patch("/venues/refitted", json={"field": {"length_m": 100}}).raise_for_status()
    assert "Again</button>" not in shown_at(stub, path)


def test_what_was_changed_a_moment_ago_is_said_without_a_word_of_requests(stub, stored, visit):
    job = stored.calibrated("raced")
    page = visit(stub.url, f"/ui/jobs/{job}", forgiven=("409",))
    moved_by_hand(stub, "raced")
    press_and_confirm(page.get_by_role("button", name="Undo"))
    said = page.get_by_role("status").filter(has_text="changed since")
    expect(said).to_have_text("The venue has been changed since this job. Load the page again to see how it is now.")


def test_a_job_that_was_deleted_is_not_linked_to(stub, stored):
    job = stored.calibrated("pruned")
    stub.http.delete(f"/jobs/{job}").raise_for_status()
    shown = shown_at(stub, "/ui/venues/pruned")
    assert "(job deleted)" in shown
    assert not re.search(rf'href="[^"]*{job}', shown)
    gone = shown_at(stub, f"/ui/jobs/{job}", 404)
    assert "It was deleted: by somebody, or since it ended more than" in gone


def test_a_stitch_error_that_nobody_could_measure_has_no_length(stub, stored):
    job = stored.calibrated("alone")
    with stub.database() as connection:
        of_job = tables.jobs.c.id == job
        result = connection.scalar(sa.select(tables.jobs.c.result).where(of_job))
        unmeasured = result | {"stitch_error_px": None, "stitch_error_before_px": None}
        connection.execute(sa.update(tables.jobs).where(of_job).values(result=unmeasured))
    for path in ("/ui/venues/alone", f"/ui/jobs/{job}"):
        (keys,) = re.findall(r'<dl class="keys.*?</dl>', shown_at(stub, path), re.DOTALL)
        assert words_of(keys).count("not measured") == 2
        assert "–on the pitch" not in words_of(keys)


def test_a_knocked_camera_is_accepted_where_it_was_found_by_one_click(stub, visit):
    name = stub.venue("knocked-page", "knock")
    job = stub.calibrated(name)["id"]
    page = visit(stub.url, f"/ui/jobs/{job}")
    right = page.get_by_role("article", name="right")
    expect(right.get_by_text("turned by 11.2 degrees and moved by 0.30 m")).to_be_visible()
    expect(right.get_by_role("link", name="The camera was knocked")).to_be_visible()
    asked = press_and_confirm(right.get_by_role("button", name="Accept right where it was found"))
    expect(page.get_by_role("button", name="Accept")).to_have_count(0)
    assert asked.startswith("Does camera right stand where it was found? Look at the new pose in its frame")
    page.goto(f"{stub.url}/ui/venues/{name}")
    expect(page.get_by_role("link", name="accepted by hand")).to_be_visible()


def test_the_failed_jobs_of_a_list_are_run_again_at_once(stub, visit):
    name = stub.venue("failing", "fail")
    failed = stub.calibrated(name)["id"]
    page = visit(stub.url, f"/ui/jobs?venue={name}", forgiven=("410",))
    expect(page.locator("td", has_text=failed)).to_be_visible()
    expect(page.get_by_role("button", name="again")).to_have_count(0)
    page.goto(f"/ui/jobs?venue={name}&status=failed")
    address = f"**/jobs/{failed}/again"
    gone = {"type": "/problems/frames-deleted", "detail": "Its frames are gone."}
    page.route(address, lambda route: route.fulfill(status=410, json=gone))
    press_and_confirm(page.get_by_role("button", name="Run 1 again"))
    expect(page.locator("#says")).to_have_text("0 of 1 jobs run again. Its frames are gone.")
    page.unroute(address)
    stub.venue(name)
    press_and_confirm(page.get_by_role("button", name="Run 1 again"))
    expect(page.locator("#says")).to_have_text("1 of 1 jobs run again.")
    (again,) = [job for job in stub.http.get("/jobs", params={"venue": name}).json()["jobs"] if job["id"] != failed]
    assert stub.end(again["id"])["status"] == "succeeded"
