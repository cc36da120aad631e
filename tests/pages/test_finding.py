"""Cameras that are found, as somebody sees them: a venue from frames alone, candidates, a camera found again."""

import re

import pytest
from playwright.sync_api import expect

from service.schemas.names import id_like
from service.store.jobs.queries import ONE
from testbed.running import png, upload
from tests.pages import browsing
from tests.service.routes.test_check import calibration
from tests.service.routes.test_find import depth, find, forget_frames, found, site


@pytest.fixture
def name(request):
    """A venue's id that no other test has."""
    return re.sub("[^a-z0-9]+", "-", request.node.name.lower()).strip("-")[-60:].strip("-")


@pytest.fixture
def files(tmp_path):
    for camera in ("left", "right"):
        (tmp_path / f"{camera}.png").write_bytes(png())
    return [tmp_path / "left.png", tmp_path / "right.png"]


def test_a_venue_is_made_of_frames_by_three_clicks(stub, visit, files, name):
    page = visit(stub.url, "/ui/new-venue")
    assert re.fullmatch("venue-[0-9]+", page.get_by_label("Id", exact=True).first.input_value())
    page.get_by_label("Id", exact=True).first.fill(name)
    button = page.get_by_role("button", name="Find the cameras")
    expect(page.get_by_text("Still missing: a frame.")).to_be_visible()
    page.locator("#frames .drop-zone input").set_input_files(files)
    expect(button).to_be_enabled()
    page.get_by_label("Stands on the side").first.select_option("near")
    page.get_by_label("Field of view").nth(1).fill("65")
    button.click()
    page.wait_for_url("**/ui/jobs/*")
    expect(page.get_by_role("button", name="Create the venue")).to_be_enabled()
    assert stub.http.get(f"/venues/{name}").status_code == 404
    with stub.database() as connection:
        sought = stored_site(connection, page.url.rpartition("/")[2])
    assert sought["cameras"] == [{"id": "left", "side": "near"}, {"id": "right", "field_of_view_deg": 65}]
    search = page.url
    page.get_by_role("button", name="Create the venue").click()
    expect(page.get_by_role("heading", name=f"Calibration of {name}")).to_be_visible()
    expect(page.get_by_role("heading", name="Stitched view")).to_be_visible()
    assert stub.job(page.url.rpartition("/")[2])["frames"].keys() == {"left", "right"}
    page.goto(f"/ui/venues/{name}")
    expect(page.get_by_text("found from frames")).to_be_visible()
    page.goto(search)
    expect(page.get_by_text("Taken, as revision 1 of")).to_be_visible()


def test_a_calibration_of_another_tool_gives_the_first_poses(stub, visit, files, tmp_path, name):
    page = visit(stub.url, "/ui/new-venue", forgiven=("400", "422"))
    page.get_by_label("Id", exact=True).first.fill(name)
    page.locator("#frames .drop-zone input").set_input_files(files)
    chosen, spoiled = page.get_by_label("Calibration of any tool"), tmp_path / "Calib.toml"
    spoiled.write_text("[cam_01]\nmatrix = 1")
    chosen.set_input_files(spoiled)
    expect(page.locator("#calibration .wrong")).to_contain_text(
        "Calib.toml, cam_01.matrix: expected a matrix of 3x3 numbers"
    )
    lens = tmp_path / "lens.yaml"
    lens.write_bytes(calibration("opencv", "top")["top.yml"].partition(b"rvec")[0])
    chosen.set_input_files(lens)
    expect(page.locator("#calibration .wrong")).to_contain_text(
        "Camera lens of the calibration: expected a pose, got none"
    )
    expect(page.get_by_role("button", name="Find the cameras")).to_be_enabled()
    for camera in ("left", "top"):
        chosen.set_input_files(written(tmp_path, calibration("colmap", camera, "right")))
        expect(page.get_by_role("status").filter(has_text=f"colmap: {min(camera, 'right')}")).to_contain_text(
            "Not read: points3D.txt"
        )
    expect(page.get_by_text("Still missing: an id of the calibration (right, top) for left.png.")).to_be_visible()
    page.get_by_label("Id", exact=True).nth(1).fill("top")
    page.get_by_role("button", name="Create and calibrate").click()
    expect(page.get_by_role("heading", name=f"Calibration of {name}")).to_be_visible()
    stored = {camera["id"]: camera for camera in stub.http.get(f"/venues/{name}").json()["cameras"]}
    assert stored.keys() == {"right", "top"}
    assert stub.job(page.url.rpartition("/")[2])["frames"].keys() == {"right", "top"}


def test_a_calibration_is_put_aside_for_a_search(stub, visit, files, tmp_path):
    page = visit(stub.url, "/ui/new-venue")
    page.get_by_label("Calibration of any tool").set_input_files(
        written(tmp_path, calibration("pose2sim", "left", "right"))
    )
    page.locator("#frames .drop-zone input").set_input_files(files)
    expect(page.get_by_role("button", name="Create and calibrate")).to_be_enabled()
    page.get_by_role("button", name="Search without it").click()
    expect(page.get_by_role("button", name="Find the cameras")).to_be_enabled()
    expect(page.get_by_role("button", name="Create and calibrate")).not_to_be_visible()


def written(folder, files):
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in files]


def test_where_no_calibration_can_follow_the_page_says_so(stub, visit, name):
    job = found(stub, name, place=site(name))
    page = visit(stub.url, f"/ui/jobs/{job['id']}", forgiven=("410",))
    forget_frames(stub, job)
    page.get_by_role("button", name="Create the venue").click()
    expect(page.locator("#refused")).to_contain_text("The poses are stored, but not calibrated yet. Frames are deleted")
    page.get_by_role("link", name="To the venue").click()
    page.wait_for_url(f"**/ui/venues/{name}")
    assert [depth(stub.http.get(f"/venues/{name}").json(), camera) for camera in ("left", "right")] == [40, 40]


@pytest.mark.long
def test_pages_that_were_proposed_the_same_id_search_for_venues_of_their_own(stub, visit, files):
    pages = [visit(stub.url, "/ui/new-venue") for _ in range(2)]
    assert len({page.get_by_label("Id", exact=True).first.input_value() for page in pages}) == 1
    for page in pages:
        page.locator("#frames .drop-zone input").set_input_files(files)
        page.get_by_role("button", name="Find the cameras").click()
        page.wait_for_url("**/ui/jobs/*")
    venues = set()
    for page in pages:
        search = page.url
        page.get_by_role("button", name="Create the venue").click()
        page.wait_for_url(lambda url, search=search: url != search)
        venues.add(stub.job(page.url.rpartition("/")[2])["venue"])
    assert len(venues) == 2


def test_browser_and_service_spell_an_id_like_a_name_alike(stub, visit):
    page = visit(stub.url, "/ui/new-venue")
    names = ["Camera Süd 01", "Cam 1", "Øst_Łódź", "STRASSE – ẞ", "İzmir ıŞIK", "камера", "-a-", "é" * 99]
    spelt = """async names => {
        const {idLike} = await import(new URL("steps.js", document.querySelector("script[src*='newvenue.js']").src));
        return names.map(idLike);
    }"""
    assert page.evaluate(spelt, names) == [id_like(name) for name in names]


def stored_site(connection, job):
    return connection.execute(ONE, {"job_id": job}).one().site


def test_where_several_poses_explain_a_frame_a_person_chooses_by_a_click(stub, visit, name):
    job = found(stub, name, place=site(name, "partly"))
    page = visit(stub.url, f"/ui/jobs/{job['id']}")
    button = page.get_by_role("button", name="Create the venue")
    expect(page.get_by_text("Choose a candidate of right, or none.")).to_be_visible()
    expect(button).to_be_disabled()
    expect(page.get_by_text("Two poses explain the frame alike")).to_be_visible()
    page.locator("[data-camera=right]").get_by_label("Candidate 2").check()
    button.click()
    expect(page.get_by_role("heading", name=f"Calibration of {name}")).to_be_visible()
    stub.end(page.url.rpartition("/")[2])
    # The stub of a calibration moves the one that it accepts an eighth of the way nearer.
    assert [depth(stub.http.get(f"/venues/{name}").json(), camera) for camera in ("left", "right")] == [35, 60]
    # The page loads itself again at the end of its job, and would break off what is opened just then.
    expect(page.get_by_text("Accepted").first).to_be_visible()
    page.goto(f"/ui/jobs/{job['id']}")
    expect(page.get_by_text("Taken, as revision 1 of")).to_be_visible()
    expect(button).to_have_count(0)


def test_what_was_found_is_said_not_to_be_saved_and_how_well_it_is_known(stub, visit, name):
    page = visit(stub.url, f"/ui/jobs/{found(stub, name, place=site(name))['id']}")
    expect(page.get_by_text("Found, not saved yet")).to_be_visible()
    expect(page.get_by_text("Accepted")).to_have_count(0)
    expect(page.get_by_text("± 17.0 cm, 0.350°").first).to_be_visible()
    expect(page.get_by_text("Agreement")).to_have_count(0)


def test_cameras_whose_side_is_assumed_are_swapped_by_a_click(stub, visit, name):
    page = visit(stub.url, f"/ui/jobs/{found(stub, name, place=site(name))['id']}")
    swap = page.get_by_role("button", name="Swap: it stands on the far side")
    for position in ("0.0, -60.0, 8.0 m", "0.0, -40.0, 8.0 m", "0.0, -60.0, 8.0 m"):
        swap.click()
        expect(page.get_by_text(position).locator("visible=true")).to_have_count(2)
    page.get_by_role("button", name="Create the venue").click()
    expect(page.get_by_role("heading", name=f"Calibration of {name}")).to_be_visible()
    stub.end(page.url.rpartition("/")[2])
    # The stub of a calibration moves each camera an eighth of the way nearer.
    assert [depth(stub.http.get(f"/venues/{name}").json(), camera) for camera in ("left", "right")] == [52.5, 52.5]


def test_a_search_that_failed_shows_three_candidates_and_what_may_help(stub, visit, name):
    page = visit(
        stub.url,
        f"/ui/jobs/{found(stub, name, files=upload(cameras=('left',)), place=site(name, 'hopeless', ['left']))['id']}",
    )
    expect(page.get_by_text("Not all found")).to_be_visible()
    expect(page.get_by_text("What may help: to choose the candidate")).to_be_visible()
    expect(page.locator(".candidate:visible")).to_have_count(3)
    page.get_by_text("What else was considered (10)").click()
    expect(page.locator(".candidate:visible")).to_have_count(13)


def test_what_cannot_be_taken_any_more_says_so(stub, visit, name):
    job = found(stub, name, place=site(name))
    page = visit(stub.url, f"/ui/jobs/{job['id']}", forgiven=("409",))
    stub.venue(name)
    page.get_by_role("button", name="Create the venue").click()
    expect(page.locator("#refused")).to_have_text(
        "The venue has been changed since this job. Load the page again to see how it is now."
    )
    page.reload()
    expect(page.get_by_text("The venue was changed since")).to_be_visible()


def test_a_camera_of_a_venue_is_found_again_and_its_neighbour_stays(stub, visit, files, name):
    stub.venue(name)
    page = visit(stub.url, f"/ui/venues/{name}/settings")
    page.get_by_role("link", name="Find cameras").click()
    page.locator("[data-camera=left] input[type=file]").set_input_files(files[0])
    button = page.get_by_role("button", name="Find", exact=True)
    expect(button).to_be_enabled()
    page.get_by_text("What stays the same").click()
    page.get_by_label("Find their lenses").check()
    button.click()
    page.wait_for_url("**/ui/jobs/*")
    page.get_by_role("button", name="Store these poses").click()
    page.wait_for_url(f"**/ui/venues/{name}")
    assert [depth(stub.http.get(f"/venues/{name}").json(), camera) for camera in ("left", "right")] == [40, 50]


def test_a_search_says_how_long_it_will_still_take(stub, visit, name):
    job = find(stub, name, place=site(name, "hang")).json()
    page = visit(stub.url, f"/ui/jobs/{job['id']}")
    expect(page.get_by_text("search, about 3 min left")).to_be_visible()
    stub.http.post(f"/jobs/{job['id']}/cancel")


def test_a_search_is_followed_to_its_end(stub, visit, name):
    job = find(stub, name, place=site(name, "accept 1")).json()
    page = visit(stub.url, f"/ui/jobs/{job['id']}")
    expect(page.get_by_role("heading", name=f"Search for cameras of {name}")).to_be_visible()
    expect(page.get_by_role("button", name="Create the venue")).to_be_enabled()


@pytest.mark.long
def test_everybody_can_use_the_pages_on_which_cameras_are_found_on_a_phone_too(stub, visit, name, files):
    job = found(stub, name, place=site(name, "partly"))
    page = visit(stub.url, "/ui/new-venue")
    page.set_viewport_size({"width": 390, "height": 844})
    page.locator("#frames .drop-zone input").set_input_files(files)
    expect(page.locator(".found-frames li")).to_have_count(2)
    for address in (None, f"/ui/jobs/{job['id']}"):
        if address:
            page.goto(address)
            page.wait_for_load_state("networkidle")
        assert browsing.grave(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
