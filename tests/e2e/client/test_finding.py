"""`esc find` and `esc venue find`, as somebody calls them who has frames and knows the sport."""

import json

import cv2
import numpy as np
import pytest

from testbed.rendered_pair import SIZE, cameras, encoded, frames, venue
from testbed.running import FRAMES
from tests.e2e.commands import esc_here
from tests.once import made_once


def site(**known):
    """Nothing but field and names of the cameras, and what is known of each."""
    place = venue("stadium")
    own = {one["id"]: one for one in place["cameras"]}
    place["cameras"] = [{"id": name, **{part: own[name][part] for part in known.get(name, ())}} for name in own]
    return place


def write(folder, place, shown=None):
    (folder / "site.json").write_text(json.dumps(place))
    for camera, frame in (shown or frames()).items():
        (folder / f"{camera}.jpg").write_bytes(frame)


def grey():
    frame = encoded(np.full((SIZE[1], SIZE[0], 3), 128, np.uint8))
    return {"left": frame, "right": frame}


def find(folder, *more):
    given = ("left=left.jpg", "right=right.jpg")
    return esc_here(folder, "find", "site.json", *given, "-o", "venue.json", "--pictures", "pictures", *more)


def found_by_lens(folder):
    lens = ("image_size", "intrinsics")
    write(folder, site(left=lens, right=lens))
    answer = find(folder)
    (folder / "answer.json").write_text(json.dumps([answer.returncode, answer.stdout, answer.stderr]))


@pytest.fixture
def answered(tmp_path_factory):
    """The folder of a site whose lenses are known, and the answer."""
    folder = made_once(tmp_path_factory, "found-by-lens", found_by_lens)
    return folder, *json.loads((folder / "answer.json").read_text())


@pytest.mark.long
def test_cameras_of_known_lenses_are_found_and_the_venue_is_written(answered):
    folder, code, out, err = answered
    assert code == 0, err
    found = json.loads((folder / "venue.json").read_text())
    for truth, camera in zip(cameras(), found["cameras"], strict=True):
        assert np.linalg.norm(np.array(camera["pose"]["position"]) - truth.pose.position) < 0.15
    assert json.loads(out)["accepted"]
    assert "Camera left: (-0." in err
    assert "assumed: it stands on the near side" in err


@pytest.mark.long
def test_what_was_found_calibrates(answered, tmp_path):
    folder, *_ = answered
    command = ("run", "venue.json", "left=left.jpg", "right=right.jpg", "-o", str(tmp_path / "out"))
    answer = esc_here(folder, *command)
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["path"] == "near"


@pytest.mark.long
def test_each_candidate_has_a_picture(answered):
    folder, *_ = answered
    picture = cv2.imread(str(folder / "pictures" / "candidate_left_1.jpg"))
    assert picture.shape == (SIZE[1], SIZE[0], 3)


@pytest.mark.long
def test_a_frame_that_shows_no_field_is_refused_with_why_and_writes_no_venue(tmp_path):
    lens = ("image_size", "intrinsics")
    write(tmp_path, site(left=lens, right=lens), grey())
    answer = find(tmp_path)
    assert answer.returncode == 3
    assert "Camera left was not found: " in answer.stderr
    assert not (tmp_path / "venue.json").exists()


@pytest.mark.parametrize(
    ("change", "frames_given", "said"),
    [
        (lambda place: None, ("left=left.jpg",), "Give a frame of each camera without a pose: right=FILE"),
        (lambda place: None, ("left=left.jpg", "right=right.jpg", "top=left.jpg"), "The site has no camera top"),
        (lambda place: place["cameras"].pop(), ("left=left.jpg", "right=right.jpg"), "The site has no camera right"),
        (
            lambda place: place["cameras"][0].update(field_of_view_deg=70, **lens_of(0)),
            ("left=left.jpg", "right=right.jpg"),
            "has intrinsics and field_of_view_deg",
        ),
        (
            lambda place: place.update(cameras=venue("stadium")["cameras"]),
            ("left=left.jpg",),
            "All cameras of the site have poses already",
        ),
    ],
)
def test_what_cannot_be_asked_is_said(tmp_path, change, frames_given, said):
    place = site()
    change(place)
    write(tmp_path, place, grey())
    answer = esc_here(tmp_path, "find", "site.json", *frames_given, "-o", "venue.json")
    assert answer.returncode == 2
    assert said in answer.stderr


def lens_of(number):
    camera = venue("stadium")["cameras"][number]
    return {part: camera[part] for part in ("image_size", "intrinsics")}


CANDIDATES = ["candidate_left_1.jpg", "candidate_left_2.jpg", "candidate_right_1.jpg", "candidate_right_2.jpg"]


def test_a_service_is_asked_for_a_venue_that_is_not_there_yet_and_stores_it_when_told(service, esc, name, tmp_path):
    asked = ("venue", "find", name, *FRAMES, "--sport", "football")
    done = esc(*asked, "--pictures", "seen")
    assert done.returncode == 0, done.stderr
    assert "Camera left: (0.00, -40.00, 8.00) m, focal length 50 px, 90% of the lines" in done.stderr
    assert sorted(file.name for file in (tmp_path / "seen").iterdir()) == CANDIDATES
    assert service.http.get(f"/venues/{name}").status_code == 404
    assert "has these cameras now" in esc(*asked, "--adopt").stderr
    assert esc("venue", "history", name).stdout.split("\t")[2] == "found"
    again = esc(*asked)
    assert (again.returncode, "leave out the part site" in again.stderr) == (1, True)


def test_a_candidate_is_chosen_by_its_number(service, esc, name, tmp_path):
    known = {"id": name, "name": "partly", "field": {"template": "football"}}
    (tmp_path / "site.json").write_text(json.dumps(known | {"cameras": [{"id": "left"}, {"id": "right"}]}))
    done = esc("venue", "find", name, *FRAMES, "--site", "site.json", "--adopt")
    assert done.returncode == 3
    assert "Rejected: camera right: two poses explain the frame alike" in done.stderr
    assert f"Nothing is stored. To choose: esc venue adopt {name} --found " in done.stderr
    assert service.http.get(f"/venues/{name}").status_code == 404
    job = json.loads(done.stdout)["id"]
    open_one = esc("venue", "adopt", name, "--found", job)
    assert open_one.returncode == 1
    assert "Choose one of the candidates of right" in open_one.stderr
    taken = esc("venue", "adopt", name, "--found", job, "--candidate", "right=2", "--calibrate")
    assert taken.returncode == 0
    assert "calibrates it with the frames of the search" in taken.stderr
    assert [camera["pose"]["position"][1] for camera in json.loads(taken.stdout)["cameras"]] == [-40, -60]


def test_without_wait_a_search_is_told_and_waited_for_by_its_job(service, esc, name):
    service.venue(name, "reject")
    done = esc("venue", "find", name, FRAMES[0], "--options", '{"find_lens": true}')
    assert done.returncode == 0
    assert esc("job", "wait", json.loads(done.stdout)["job"]).returncode == 3
