import io
import zipfile
from typing import get_args

import OpenEXR
import pytest

from service.schemas.names import FormatName
from testbed.program import NEARER
from testbed.running import SIZE
from tests.problems import problem_of

pytestmark = pytest.mark.slow


def poses(service, path, form, **more):
    return service.http.get(f"{path}/poses", params={"format": form, **more})


@pytest.mark.parametrize(
    ("form", "media_type", "file"),
    [
        ("json", "application/json", "json.json"),
        ("opencv", "application/zip", "opencv.zip"),
        ("opentrackio", "application/zip", "opentrackio.zip"),
        ("freed", "application/octet-stream", "freed.d1"),
        ("colmap", "application/zip", "colmap.zip"),
        ("soccernet", "application/zip", "soccernet.zip"),
        ("pose2sim", "application/toml", "pose2sim.toml"),
        ("metropolis", "application/json", "metropolis.json"),
    ],
)
def test_the_poses_that_hold_are_a_file_in_each_format(service, name, form, media_type, file):
    service.venue(name)
    answer = poses(service, f"/venues/{name}", form)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == media_type
    assert answer.headers["content-disposition"] == f'attachment; filename="{name}-{file}"'


def test_formats_of_one_camera_come_in_a_zip_or_alone(service, name):
    service.venue(name)
    with zipfile.ZipFile(io.BytesIO(poses(service, f"/venues/{name}", "opencv").content)) as files:
        assert files.namelist() == ["left.yml", "right.yml"]
        alone = poses(service, f"/venues/{name}", "opencv", camera="right")
        assert alone.content == files.read("right.yml")
    assert alone.headers["content-type"] == "application/yaml"
    assert alone.headers["content-disposition"] == f'attachment; filename="{name}-right-opencv.yml"'


def test_the_number_of_a_camera_stays_when_it_is_asked_for_alone(service, name):
    service.venue(name)
    both, right = (poses(service, f"/venues/{name}", "freed", **more).content for more in ({}, {"camera": "right"}))
    assert (both[1], both[30], right) == (1, 2, both[29:])


def test_a_table_of_the_lens_is_stored_and_counts_in_packets_of_freed(service, name):
    service.venue(name)
    encoders = {"focus": {"distance_m": 30, "counts": [[20, 1000], [40, 3000]]}, "zoom": None}
    patched = service.http.patch(f"/venues/{name}", json={"cameras": {"left": {"encoders": encoders}}})
    assert (patched.status_code, patched.json()["cameras"][0]["encoders"]) == (200, encoders)
    left, right = (poses(service, f"/venues/{name}", "freed", camera=camera).content for camera in ("left", "right"))
    assert (left[23:26], right[20:26]) == ((2000).to_bytes(3, "big"), bytes(6))


def test_st_maps_are_made_for_one_camera(service, name, tmp_path):
    service.venue(name)
    which = poses(service, f"/venues/{name}", "st-map").json()
    assert (which["type"], which["expected"]) == ("/problems/camera-needed", ["left", "right"])
    answer = poses(service, f"/venues/{name}", "st-map", camera="left")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as files:
        assert files.namelist() == ["undistort.exr", "distort.exr"]
        with OpenEXR.File(files.extract("distort.exr", tmp_path)) as exr:
            assert exr.channels()["RGB"].pixels.shape == (SIZE[1], SIZE[0], 3)


def test_a_file_that_the_caller_has_is_not_sent_again(service, name):
    service.venue(name)
    first = poses(service, f"/venues/{name}", "colmap")
    headers = {"If-None-Match": first.headers["etag"]}
    again = service.http.get(f"/venues/{name}/poses", params={"format": "colmap"}, headers=headers)
    assert (again.status_code, again.content) == (304, b"")
    other = service.http.get(f"/venues/{name}/poses", params={"format": "freed"}, headers=headers)
    assert other.status_code == 200


def test_a_format_that_is_none_is_refused_with_those_there_are(service, name):
    service.venue(name)
    answer = poses(service, f"/venues/{name}", "fbx")
    assert problem_of(answer) == (422, "invalid-request")
    for form in get_args(FormatName):
        assert f"'{form}'" in answer.json()["detail"]


def test_a_camera_that_is_none_is_refused_with_those_there_are(service, name):
    service.venue(name)
    answer = poses(service, f"/venues/{name}", "json", camera="middle")
    assert (answer.status_code, answer.json()["expected"]) == (422, ["left", "right"])
    assert poses(service, "/venues/nowhere", "json").status_code == 404


def test_a_job_gives_the_poses_it_found_whatever_holds_now(service, name):
    job = service.submitted(service.venue(name, "reject"))
    service.end(job)
    before = poses(service, f"/venues/{name}", "json").json()["cameras"][0]["pose"]
    found = poses(service, f"/jobs/{job}", "json")
    assert found.headers["content-disposition"] == f'attachment; filename="{name}-{job}-json.json"'
    assert found.json()["cameras"][0]["pose"]["position"][0] == before["position"][0] * NEARER
    assert found.json() == service.http.get(f"/jobs/{job}/poses").json()


def test_a_job_without_a_result_has_no_poses(service, name):
    job = service.submitted(service.venue(name, "fail"))
    service.end(job)
    answer = poses(service, f"/jobs/{job}", "json")
    assert problem_of(answer) == (404, "poses-not-found")
