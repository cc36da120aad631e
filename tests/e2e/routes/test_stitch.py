"""The stitched view leaves the service: its package for other tools, and its preview."""

import io
import json
import zipfile

import cv2
import numpy as np
import pytest

from tests.problems import problem_of

SMALL = {"projection": "cylinder", "width_px": 320, "height_px": 120}


def stitch(service, name, tag=None, **params):
    return service.http.get(
        f"/venues/{name}/stitch", params={**SMALL, **params}, headers={"If-None-Match": tag} if tag else {}
    )


def files_of(answer):
    with zipfile.ZipFile(io.BytesIO(answer.raise_for_status().content)) as files:
        return {name: files.read(name) for name in files.namelist()}


@pytest.mark.parametrize(
    ("form", "of_format"),
    [
        ("ffmpeg", {"stitch.ffscript", "stitch.sh", "left_x.pgm", "left_y.pgm", "right_mask.pgm"}),
        ("st-map", {"left.exr", "right.exr"}),
        ("st-map-unreal", {"left.exr", "right.exr"}),
        ("opencv", {"stitch.py", "maps.npz"}),
    ],
)
def test_each_format_is_a_zip_that_says_how_it_is_used(service, name, form, of_format):
    service.venue(name)
    answer = stitch(service, name, format=form)
    assert answer.headers["content-type"] == "application/zip"
    assert answer.headers["content-disposition"] == f'attachment; filename="{name}-stitch-{form}.zip"'
    files = files_of(answer)
    assert of_format | {"README.txt", "view.json"} <= files.keys()
    about = json.loads(files["view.json"])
    assert (about["revision"], about["size_px"], about["etag"]) == (1, [320, 120], answer.headers["etag"])
    assert [camera["id"] for camera in about["cameras"]] == ["left", "right"]
    assert f"--format {form}" in files["README.txt"].decode()


def test_a_package_holds_until_a_pose_or_the_view_changes(service, name):
    service.venue(name)
    first = stitch(service, name).headers["etag"]
    service.venue(name)
    assert stitch(service, name, first).status_code == 304
    others = {stitch(service, name, first, **other).headers["etag"] for other in ({"format": "opencv"}, {"pan_deg": 3})}
    assert len(others | {first}) == 3
    service.calibrated(name)
    moved = stitch(service, name, first)
    assert moved.status_code == 200
    assert moved.headers["etag"] != first
    light = {"gain": [1.1, 1.0, 0.9], "falloff": 0.1}
    patch = {"cameras": {"left": {"light": light}}}
    service.http.patch(f"/venues/{name}", json=patch, headers={"Content-Type": "application/merge-patch+json"})
    brighter = stitch(service, name, moved.headers["etag"])
    about = json.loads(files_of(brighter)["view.json"])
    left, right = (camera["light"] for camera in about["cameras"])
    assert light.items() <= left.items()
    assert right is None


def test_the_view_is_the_venues_unless_a_request_has_it_otherwise(service, name):
    service.venue(name)
    view = {"projection": "birds-eye", "width_px": 320, "height_px": 240}
    type_ = {"Content-Type": "application/merge-patch+json"}
    kept = service.http.patch(f"/venues/{name}", json={"view": view}, headers=type_)
    assert kept.json()["view"] == {"field_of_view_deg": None, "pan_deg": 0.0, "horizon": None} | view
    assert kept.json()["view"] == service.http.get(f"/venues/{name}").json()["view"]

    def size(**params):
        answer = service.http.get(f"/venues/{name}/stitch", params=params)
        return json.loads(files_of(answer)["view.json"])["size_px"]

    assert size() == [320, 240]
    assert size(width_px=322) == [322, 240]
    assert size(height_px="auto") == [320, 214]


@pytest.mark.parametrize(
    "params", [{"width_px": 321}, {"width_px": 9000}, {"pan_deg": "nan"}, {"horizon": "high"}, {"format": "mp4"}]
)
def test_a_view_that_no_picture_can_have_is_refused(service, name, params):
    service.venue(name)
    answer = stitch(service, name, **params)
    assert problem_of(answer) == (422, "invalid-request")


def test_a_view_of_too_many_pixels_is_refused_with_what_helps(service, name):
    service.venue(name)
    answer = stitch(service, name, width_px=8192, height_px=8192)
    assert problem_of(answer) == (422, "view-too-large")
    assert answer.json()["detail"] == "2 cameras in 8192x8192 pixels are too much: ask for fewer pixels."


def preview(service, name, tag=None, **params):
    headers = {"If-None-Match": tag} if tag else {}
    return service.http.get(f"/venues/{name}/stitch/preview", params={**SMALL, **params}, headers=headers)


def test_a_preview_shows_the_frames_of_the_last_calibration(service, name):
    service.venue(name)
    none = preview(service, name)
    assert problem_of(none) == (404, "no-frames")
    service.calibrated(name, shade=200)
    shown = preview(service, name)
    picture = cv2.imdecode(np.frombuffer(shown.content, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (120, 320, 3)
    assert abs(np.median(picture) - 200) <= 2
    assert preview(service, name, shown.headers["etag"]).status_code == 304
    assert preview(service, name, shown.headers["etag"], seam=True).status_code == 200
    large = preview(service, name, width_px=1920, height_px=540)
    assert cv2.imdecode(np.frombuffer(large.content, np.uint8), cv2.IMREAD_COLOR).shape == (360, 1280, 3)


def test_frames_of_other_cameras_than_the_venue_has_are_no_preview(service, name):
    service.venue(name)
    service.calibrated(name)
    service.venue(name, cameras=("left", "middle"))
    assert preview(service, name).json()["type"] == "/problems/no-frames"


def test_the_command_line_fetches_a_package_only_if_it_changed(service, esc, name, tmp_path):
    service.venue(name)
    wanted = ["venue", "stitch", name, "--width", "320", "--height", "120", "--pan", "-2", "-o", "a.zip"]
    assert esc(*wanted).returncode == 0
    first = (tmp_path / "a.zip").stat().st_mtime_ns
    again = esc(*wanted, "--if-changed")
    assert (again.returncode, again.stderr) == (0, "a.zip is up to date.\n")
    assert (tmp_path / "a.zip").stat().st_mtime_ns == first
    assert esc(*wanted, "--format", "opencv", "--if-changed").returncode == 0
    assert "maps.npz" in zipfile.ZipFile(tmp_path / "a.zip").namelist()
    assert esc("venue", "stitch", name, "--if-changed").returncode == 2
    (tmp_path / "a.zip").write_bytes(b"a film")
    assert "no package of a stitched view" in esc(*wanted, "--if-changed").stderr
    odd = esc("venue", "stitch", name, "--width", "321")
    assert (odd.returncode, "multiple of 2" in odd.stderr) == (1, True)
    assert esc("venue", "set", name, 'view={"projection": "rectilinear"}').returncode == 0
    assert json.loads(esc("venue", "get", name).stdout)["view"]["projection"] == "rectilinear"
