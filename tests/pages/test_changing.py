"""A venue that is there is changed in the browser: first poses, lenses, alarms, and its end."""

import json

import pytest
from playwright.sync_api import expect

from testbed.parameters import try_first
from tests.pages import newcomer
from tests.pages.browsing import grave, press_and_confirm

OFF = [1.9, 0.3, -0.2]


@pytest.fixture
def demo(stub):
    """The venue of the demo, with poses that are wrong."""
    venue = newcomer.scaled().model_dump(mode="json") | {"id": "knocked"}
    for camera in venue["cameras"]:
        camera["pose"] = {"rotation": OFF, "position": [0, -60, 9]}
    stub.http.put("/venues/knocked", json=venue).raise_for_status()
    return "knocked"


def cameras_of(stub, name):
    return {camera["id"]: camera for camera in stub.http.get(f"/venues/{name}").json()["cameras"]}


@pytest.mark.long
def test_a_knocked_camera_gets_a_new_first_pose_and_the_others_keep_theirs(stub, visit, demo):
    before = cameras_of(stub, demo)
    page = visit(stub.url, f"/ui/venues/{demo}/first-pose")
    store = page.get_by_role("button", name="Store first poses")
    expect(store).to_be_disabled()
    step = page.locator(".camera-step").first
    step.get_by_label("A frame of it").set_input_files(newcomer.frame("left"))
    newcomer.click_points(page, 0, "left")
    expect(store).to_be_enabled()
    store.click()
    page.wait_for_url(f"**/ui/venues/{demo}")
    after = cameras_of(stub, demo)
    truth = newcomer.TRUTH["left"].position
    assert sum((one - other) ** 2 for one, other in zip(after["left"]["pose"]["position"], truth, strict=True)) < 0.2**2
    assert after["left"]["intrinsics"] == before["left"]["intrinsics"]
    assert after["right"] == before["right"]


@pytest.mark.long
def test_a_frame_of_another_size_is_refused_before_a_point_is_clicked(stub, visit):
    name = stub.venue("tiny")
    page = visit(stub.url, f"/ui/venues/{name}/first-pose")
    page.locator(".camera-step").first.get_by_label("A frame of it").set_input_files(newcomer.frame("left"))
    expect(page.get_by_text("this camera takes 64 × 48")).to_be_visible()


def test_a_lens_is_changed_by_its_file_and_what_is_wrong_with_it_is_said(stub, visit, tmp_path):
    name = stub.venue("relensed")
    page = visit(stub.url, f"/ui/venues/{name}/settings", forgiven=("422",))
    form = page.get_by_role("form", name="Lens of left")
    lens = tmp_path / "lens.json"
    matrix = [[61, 0, 32], [0, 61, 24], [0, 0, 1]]
    lens.write_text(json.dumps({"id": "left", "image_size": [128, 96], "intrinsics": {"matrix": matrix}}))
    form.get_by_label("Lens file of left").set_input_files(lens)
    expect(form.get_by_label("Lens of left, JSON")).to_have_value(lens.read_text())
    form.get_by_role("button", name="Store the lens of left").click()
    expect(form.get_by_role("alert")).to_have_text(
        "This lens is of pictures of 128 × 96 pixels; the camera has 64 × 48."
    )
    form.get_by_label("Lens of left, JSON").fill(json.dumps({"matrix": [[-1, 0, 32], [0, 61, 24], [0, 0, 1]]}))
    form.get_by_role("button", name="Store the lens of left").click()
    expect(form.get_by_role("alert")).to_contain_text("focal")
    folding = {"matrix": matrix, "distortion": [-0.99, 0, 0, 0, 0]}
    form.get_by_label("Lens of left, JSON").fill(json.dumps(folding))
    with page.expect_navigation():
        form.get_by_role("button", name="Store the lens of left").click()
    expect(form.get_by_text("This lens has no ray for")).to_be_visible()
    form.get_by_label("Lens of left, JSON").fill(json.dumps({"matrix": matrix, "distortion": [-0.1, 0, 0, 0, 0]}))
    with page.expect_navigation():
        form.get_by_role("button", name="Store the lens of left").click()
    cameras = cameras_of(stub, name)
    assert cameras["left"]["intrinsics"]["matrix"] == matrix
    assert cameras["left"]["intrinsics"]["distortion"][0] == -0.1
    assert cameras["right"]["intrinsics"]["matrix"][0][0] == 60


def test_alarms_are_set_and_taken_away(stub, visit):
    name = stub.venue("guarded")
    page = visit(stub.url, f"/ui/venues/{name}/settings", forgiven=("422",))
    moved = page.get_by_label("A calibration moves a camera by more than, px")
    moved.fill("0")
    page.get_by_role("button", name="Save alarms").click()
    expect(page.get_by_role("form", name="Alarms").get_by_role("alert")).to_have_text(
        "A calibration moves a camera by more than, px: expected more than 0 px, came 0"
    )
    moved.fill("")
    row = page.get_by_label("So many calibrations in a row without a pose")
    row.fill("three")
    page.get_by_role("button", name="Save alarms").click()
    expect(page.get_by_role("form", name="Alarms").get_by_role("alert")).to_have_text("“three” is not a number.")
    row.fill("3")
    with page.expect_navigation():
        page.get_by_role("button", name="Save alarms").click()
    assert stub.http.get(f"/venues/{name}").json()["alarms"]["rejected_in_a_row"] == 3
    expect(row).to_have_value("3")
    row.fill("")
    with page.expect_navigation():
        page.get_by_role("button", name="Save alarms").click()
    assert stub.http.get(f"/venues/{name}").json()["alarms"] is None


def test_a_change_that_somebody_else_made_meanwhile_is_not_undone(stub, visit):
    name = stub.venue("twice")
    page = visit(stub.url, f"/ui/venues/{name}/settings", forgiven=("412",))
    stub.http.patch(f"/venues/{name}", json={"alarms": {"trend_m": 0.1}}).raise_for_status()
    page.get_by_label("No pose accepted for, hours").fill("5")
    page.get_by_role("button", name="Save alarms").click()
    expect(page.get_by_role("form", name="Alarms").get_by_role("alert")).to_contain_text(
        "Somebody has changed the venue"
    )
    assert stub.http.get(f"/venues/{name}").json()["alarms"]["trend_m"] == 0.1


def test_name_and_size_of_the_field_are_changed_after_a_question_that_says_what_ends(stub, visit):
    name = stub.venue("resized")
    page = visit(stub.url, f"/ui/venues/{name}/settings")
    form = page.get_by_role("form", name="Venue", exact=True)
    form.get_by_label("Name").fill("Main pitch")
    form.get_by_role("button").click()
    expect(page.get_by_role("link", name="Main pitch")).to_be_visible()
    form.get_by_label("Length, m").fill("101,5")
    form.get_by_role("button").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    assert stub.http.get(f"/venues/{name}").json()["field"]["length_m"] == 105
    assert "trends are gone for good" in press_and_confirm(form.get_by_role("button"))
    expect(form.get_by_label("Length, m")).to_have_value("101.5")
    form.get_by_label("Sport").select_option("tennis")
    with page.expect_navigation():
        press_and_confirm(form.get_by_role("button"))
    field = stub.http.get(f"/venues/{name}").json()["field"]
    assert (field["template"], field["length_m"], field["width_m"]) == ("tennis", 23.77, 10.97)


@pytest.mark.parametrize("leave", try_first(["Escape", "Cancel"]))
def test_nothing_happens_to_who_leaves_a_question(stub, stored, visit, leave):
    name = f"asked-{leave.lower()}"
    stored.calibrated(name)
    page = visit(stub.url, f"/ui/venues/{name}")
    page.get_by_role("button", name="Undo").click()
    dialog = page.get_by_role("dialog", name="Undo this calibration?")
    expect(dialog).to_contain_text("The cameras get back the poses from before it, as a new revision.")
    assert grave(page) == []
    if leave == "Escape":
        page.keyboard.press("Escape")
    else:
        dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)
    expect(page.get_by_role("button", name="Undo")).to_be_focused()
    assert stub.http.get(f"/venues/{name}/history").json()["revisions"][0]["revision"] == 2


def test_a_venue_is_deleted_once_its_id_was_typed(stub, visit):
    name = stub.venue("doomed")
    page = visit(stub.url, f"/ui/venues/{name}/settings")
    delete = page.get_by_role("button", name="Delete doomed")
    typed = page.get_by_label("Type its id")
    typed.fill("doome")
    expect(delete).to_be_disabled()
    typed.press("Enter")
    assert stub.http.get(f"/venues/{name}").status_code == 200
    typed.fill("doomed")
    assert "Nobody can restore them" in press_and_confirm(delete)
    page.wait_for_url(f"{stub.url}/")
    assert stub.http.get(f"/venues/{name}").status_code == 404


def test_an_id_that_is_taken_is_said_where_it_is_typed(stub, visit):
    name = stub.venue("known")
    page = visit(stub.url, "/ui/new-venue")
    page.get_by_label("Id", exact=True).first.fill(name)
    expect(page.get_by_text("There is a venue of this id already.")).to_be_visible()
    expect(page.get_by_role("link", name="new first poses")).to_have_attribute("href", f"/ui/venues/{name}/first-pose")
    page.get_by_label("Id", exact=True).first.fill(f"{name}-not")
    expect(page.get_by_text("There is a venue of this id already.")).to_be_hidden()
