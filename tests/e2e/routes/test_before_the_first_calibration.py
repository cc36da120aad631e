"""Lenses and first poses by HTTP and by `esc`, computed by the real program."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest

from service.formats.conversion import members_of, write_cameras
from service.schemas.geometry import Pose
from testbed import rendered_pair
from testbed.boards import board_places
from testbed.running import png
from tests.e2e.commands import esc_here
from tests.problems import problem_of
from tests.service.cli.test_check import records
from tests.worker.calibration.onboarding.test_first_pose import CAMERA, LENS, SIZE, clicks
from tests.worker.calibration.onboarding.test_lens_calibration import BOARD
from tests.worker.calibration.onboarding.test_lens_calibration import CAMERA as BOARD_CAMERA

WAIT = {"wait": 60}


@pytest.fixture
def service(service_with_engine):
    return service_with_engine


def photos(count):
    """So many photos of a board and one of none, encoded."""
    seen = [place for place in board_places(20) if BOARD_CAMERA.corners(BOARD, *place)]
    files = {f"board {number}.jpg": BOARD_CAMERA.photograph(BOARD, *place) for number, place in enumerate(seen[:count])}
    files["empty.png"] = np.full((960, 1280), 90, np.uint8)
    return {name: cv2.imencode(name[-4:], photo)[1].tobytes() for name, photo in files.items()}


def parts(files, **options):
    return [*[("photos", (name, data)) for name, data in files.items()], ("options", (None, json.dumps(options)))]


BOARD_OPTIONS = {"columns": 9, "rows": 6, "square_m": 0.03}


@pytest.mark.long
def test_photos_of_a_board_become_a_lens(service):
    answer = service.http.post("/intrinsics", files=parts(photos(count=6), board=BOARD_OPTIONS))
    job = answer.json()
    assert (answer.status_code, job["kind"], job["venue"]) == (202, "intrinsics", None)
    job = service.end(job["id"])
    result = job["result"]
    assert job["status"] == "succeeded", job["error"]
    assert result["intrinsics"]["matrix"][0][0] == pytest.approx(900, rel=0.02)
    assert result["image_size"] == [1280, 960]
    assert {photo["name"]: photo["fate"] for photo in result["photos"]}["empty.png"] == "no-board"
    assert set(result["sigma"]) == set(result["spread"]) == set(result["terms"])
    known = result["intrinsics"]["sigma"]
    assert known["fx"] == known["fy"] == max(result["sigma"]["f"], result["spread"]["f"])
    picture = service.http.get(job["links"]["coverage"])
    assert (picture.status_code, picture.headers["content-type"]) == (200, "image/jpeg")
    assert "venue" not in job["links"]
    assert job["id"] in [one["id"] for one in service.http.get("/jobs").json()["jobs"]]


@pytest.mark.long
def test_the_same_key_and_photos_are_the_same_job(service):
    two = photos(count=1)
    key = {"Idempotency-Key": "lens-1"}
    first, again, other = (
        service.http.post("/intrinsics", files=parts(two, board=BOARD_OPTIONS | {"rows": rows}), headers=key)
        for rows in (6, 6, 5)
    )
    assert (first.status_code, again.status_code, other.status_code) == (202, 200, 422)
    assert first.json()["id"] == again.json()["id"]
    ended = service.end(first.json()["id"])
    assert ended["error"]["type"] == "/problems/no-lens"
    assert "take 15 or more" in ended["error"]["detail"]


def test_photos_that_cannot_be_used_are_refused_by_name(service):
    some = photos(count=1)

    def refused(files, **options):
        answer = service.http.post("/intrinsics", files=parts(files, **options))
        assert answer.headers["content-type"] == "application/problem+json"
        return answer.status_code, answer.json()["type"].rpartition("/")[2], answer.json()

    (name, data), *_ = some.items()
    assert refused({}, board=BOARD_OPTIONS)[:2] == (422, "missing-photos")
    assert refused({str(n): data for n in range(9)}, board=BOARD_OPTIONS)[:2] == (422, "too-many-photos")
    status, kind, problem = refused({name: data[:2000]}, board=BOARD_OPTIONS)
    assert (status, kind, problem["photo"]) == (422, "truncated-image", name)
    assert refused(some)[:2] == (422, "invalid-request")
    assert refused(some, board=BOARD_OPTIONS, colour="red")[:2] == (422, "invalid-request")
    assert service.http.post("/intrinsics", json={}).status_code == 415


def venue(name):
    return {
        "id": name,
        "field": {"length_m": 105, "width_m": 68, "ridge": [[-18.5, 0, 0.3], [18.5, 0, 0.3]]},
        "cameras": [
            {
                "id": "left",
                "image_size": list(SIZE),
                "intrinsics": {"matrix": LENS.matrix.tolist(), "distortion": LENS.distortion.tolist()},
                "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0]},
            }
        ],
    }


def points(given=None):
    given = given or clicks(noise_px=1.0)
    return [{"world": name, "pixel": pixel.tolist()} for name, pixel in zip(given.names, given.pixel, strict=True)]


def locate(service, name, points, camera="left", files=(), **query):
    form = [*files, ("options", (None, json.dumps({"points": points})))]
    return service.http.post(f"/venues/{name}/cameras/{camera}/locate", files=form, params=query)


def test_clicked_points_become_a_first_pose_while_the_caller_waits_and_are_shown_in_their_frame(service, name):
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    frame = [("left", ("left.png", png(*SIZE, shade=70)))]
    answer = locate(service, name, points(clicks(noise_px=1.0).swapped(1, 4)), files=frame, **WAIT)
    job = answer.json()
    assert (answer.status_code, job["kind"], job["venue"], job["status"]) == (200, "locate", name, "succeeded")
    result = job["result"]
    assert result["accepted"]
    assert np.linalg.norm(np.array(result["pose"]["position"]) - CAMERA.pose.position) < 0.3
    exchanged = [point for point in result["points"] if point["exchanged_with"]]
    assert {point["world"] for point in exchanged} == {point["exchanged_with"] for point in exchanged}
    assert len(exchanged) == 2
    # It is an answer, not a change.
    stored = service.http.get(f"/venues/{name}").json()["cameras"][0]["pose"]
    assert stored["position"] == [-1.0, -50.0, 8.0]
    picture = service.http.get(job["links"]["points"]).raise_for_status().content
    drawn = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert drawn.shape == (*SIZE[::-1], 3)
    assert np.median(drawn) == 70
    assert drawn.std() > 5


@pytest.mark.long
def test_points_that_fix_no_pose_end_with_what_to_add(service, name):
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    line = [{"world": [x, -30], "pixel": [100 + 20 * x, 900 + x]} for x in (0, 10, 20, 30)]
    error = locate(service, name, line, **WAIT).json()["error"]
    assert (error["type"], error["camera"]) == ("/problems/no-pose", "left")
    assert "add points off that line" in error["detail"]
    unknown = [*points()[:4], {"world": "left penalty box, near corner", "pixel": [5, 5]}]
    error = locate(service, name, unknown, **WAIT).json()["error"]
    assert error["type"] == "/problems/unknown-landmark"
    assert "left penalty area, near corner" in error["detail"]


def test_what_is_wrong_with_a_request_is_said_at_once(service, name):
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    assert locate(service, "nowhere", points()).status_code == 404
    gone = locate(service, name, points(), camera="right")
    assert (gone.status_code, gone.json()["type"], gone.json()["expected"]) == (
        404,
        "/problems/no-such-camera",
        ["left"],
    )
    assert locate(service, name, points()[:3]).status_code == 422
    small = locate(service, name, points(), files=[("left", ("left.png", png(64, 48)))])
    assert problem_of(small) == (422, "frame-size")
    other = locate(service, name, points(), files=[("right", ("right.png", png(*SIZE)))])
    assert other.json()["type"] == "/problems/unknown-camera"


@pytest.mark.long
def test_esc_goes_from_photos_and_clicks_to_a_venue(tmp_path):
    board = photos(count=6)

    def esc(*arguments):
        command = [sys.executable, "-m", "service.cli", *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=200)

    for name, data in board.items():
        (tmp_path / name).write_bytes(data)
    found = esc(
        "intrinsics", *board, "--board", "9x6", "--square", "0.03", "-o", "lens.json", "--picture", "coverage.jpg"
    )
    assert found.returncode == 0, found.stderr
    assert "empty.png shows no board" in found.stderr
    assert json.loads((tmp_path / "lens.json").read_text())["intrinsics"]["matrix"][0][0] == pytest.approx(
        900, rel=0.02
    )
    assert json.loads((tmp_path / "lens.json").read_text())["intrinsics"]["sigma"]["fx"] > 0
    assert (tmp_path / "coverage.jpg").read_bytes().startswith(b"\xff\xd8")
    assert esc("intrinsics", *board, "--board", "9", "--square", "0.03", "-o", "x.json").returncode == 2

    whole = venue("v")
    whole["cameras"][0]["intrinsics"]["sigma"] = {"fx": 2.0}
    (tmp_path / "site.json").write_text(json.dumps({key: whole[key] for key in ("id", "field")}))
    (tmp_path / "left.json").write_text(
        json.dumps({key: whole["cameras"][0][key] for key in ("image_size", "intrinsics")})
    )
    (tmp_path / "clicks.json").write_text(json.dumps({"left": points(clicks(noise_px=1.0).swapped(0, 2))}))
    posed = esc("pose", "site.json", "clicks.json", "left=left.json", "-o", "venue.json", "--pictures", "pictures")
    assert posed.returncode == 0, posed.stderr
    assert posed.stderr.count("are exchanged") == 2
    stored = json.loads((tmp_path / "venue.json").read_text())["cameras"][0]
    assert np.linalg.norm(np.array(stored["pose"]["position"]) - CAMERA.pose.position) < 0.3
    assert stored["intrinsics"]["sigma"] == {"fx": 2.0}
    assert (tmp_path / "pictures" / "points_left.jpg").exists()

    (tmp_path / "few.json").write_text(json.dumps({"left": points()[:3]}))
    assert esc("pose", "site.json", "few.json", "left=left.json", "-o", "no.json").returncode == 2
    assert not (tmp_path / "no.json").exists()


@pytest.mark.long
def test_esc_says_which_cameras_had_their_points_exchanged(tmp_path):
    wide = replace(LENS, matrix=LENS.matrix * [[0.9], [0.9], [1]] + [[0, 0, 97], [0, 0, 53], [0, 0, 0]])
    seen = {"left": LENS, "right": wide}
    for name, lens in seen.items():
        described = {"matrix": lens.matrix.tolist(), "distortion": lens.distortion.tolist()}
        written = json.dumps({"image_size": list(SIZE), "intrinsics": described})
        (tmp_path / f"{name}.json").write_text(written)
    (tmp_path / "site.json").write_text(json.dumps({key: venue("v")[key] for key in ("id", "field")}))
    exchanged = {"left": points(clicks(camera=CAMERA.with_lens(wide))), "right": points()}
    (tmp_path / "clicks.json").write_text(json.dumps(exchanged))
    posed = esc_here(tmp_path, "pose", "site.json", "clicks.json", "left=left.json", "right=right.json", "-o", "v.json")
    assert posed.returncode == 3, posed.stderr
    assert posed.stderr.count("the points of the two cameras are exchanged, or else their lenses") == 2
    assert not (tmp_path / "v.json").exists()


@pytest.mark.long
def test_esc_hints_at_points_of_one_camera_that_were_given_for_two(tmp_path):
    """With the lens fitted to them, the points of another camera fit; the focal length is the other one's."""
    longer = replace(LENS, matrix=LENS.matrix * [[1.08, 1, 1], [1, 1.08, 1], [1, 1, 1]])
    for name, lens in (("left", LENS), ("right", longer)):
        described = {"matrix": lens.matrix.tolist(), "distortion": lens.distortion.tolist()}
        (tmp_path / f"{name}.json").write_text(json.dumps({"image_size": list(SIZE), "intrinsics": described}))
    (tmp_path / "site.json").write_text(json.dumps({key: venue("v")[key] for key in ("id", "field")}))
    of_right = points(clicks(camera=CAMERA.with_lens(longer)))
    (tmp_path / "clicks.json").write_text(json.dumps({"left": of_right, "right": of_right}))
    posed = esc_here(tmp_path, "pose", "site.json", "clicks.json", "left=left.json", "right=right.json", "-o", "v.json")
    assert posed.returncode == 0, posed.stderr
    assert posed.stderr.count("which is nearer to the lens of right (1350 px) than to that of left (1250 px)") == 1


def test_a_file_that_is_no_lens_is_answered_with_one(tmp_path):
    (tmp_path / "site.json").write_text(json.dumps({key: venue("v")[key] for key in ("id", "field")}))
    (tmp_path / "clicks.json").write_text(json.dumps({"left": points()}))
    (tmp_path / "left.json").write_text(json.dumps({"matrix": []}))
    posed = esc_here(tmp_path, "pose", "site.json", "clicks.json", "left=left.json", "-o", "v.json")
    assert posed.returncode == 2
    assert "image_size is missing" in posed.stderr
    assert 'Expected is {"image_size": [3840, 2160], "intrinsics": {"matrix": ' in posed.stderr


@pytest.mark.long
def test_a_calibration_of_another_tool_is_graded_by_frames(service):
    left, right = records()
    tilt, *rest = right.pose.rotation
    turned = Pose.from_position([tilt + math.radians(0.6), *rest], right.pose.position)
    given = [left, replace(right, pose=turned)]
    files = members_of(write_cameras(given, "pose2sim"), "pair")
    field = {"template": "football", "line_width_m": 0.12, "ridge": rendered_pair.PITCH.ridge.tolist()}
    sent = [("calibration", file) for file in files.items()]
    sent += [(camera, (f"{camera}.jpg", data)) for camera, data in rendered_pair.frames().items()]
    answer = service.http.post("/check", files=[*sent, ("options", (None, json.dumps({"field": field, "seed": 1})))])
    job = service.end(answer.raise_for_status().json()["id"])
    assert job["status"] == "succeeded", job["error"]
    assert {one["id"]: one["grade"] for one in job["result"]["cameras"]} == {"left": "good", "right": "drifted"}
    assert [cause["cause"] for cause in job["result"]["cameras"][1]["causes"]] == ["turned"]
