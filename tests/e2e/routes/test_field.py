"""Fitting a field by HTTP and by `esc`: an answer that a person puts into the venue, or not."""

import json

import pytest

from testbed.running import FRAMES, upload
from tests.problems import problem_of


def fit(service, name, options=None, headers=None, files=None):
    parts = upload() if files is None else files
    if options is not None:
        parts = [*parts, ("options", (None, json.dumps(options)))]
    return service.http.post(f"/venues/{name}/field/fit", files=parts, headers=headers)


def test_a_fitted_field_is_an_answer_and_no_change(service, name):
    service.venue(name)
    before = service.http.get(f"/venues/{name}").json()
    answer = fit(service, name, {"seed": 5})
    job = answer.json()
    assert (answer.status_code, job["kind"], job["venue"]) == (202, "field", name)
    assert answer.headers["location"] == f"/jobs/{job['id']}"
    job = service.end(job["id"])
    assert job["result"]["field"]["length_m"] == 104.25
    assert [(m["name"], m["known"]) for m in job["result"]["measures"]] == [("length_m", True), ("width_m", False)]
    assert job["result"]["provenance"]["seed"] == 5
    assert service.http.get(job["links"]["overlay/left"]).headers["content-type"] == "image/jpeg"
    assert service.http.get(f"/venues/{name}").json() == before


def test_a_key_is_one_fit_and_a_calibration_of_the_same_frames_needs_its_own(service, name):
    service.venue(name)
    key = {"Idempotency-Key": f"{name}-1"}
    first, again, other = (fit(service, name, {"seed": seed}, key) for seed in (1, 1, 2))
    assert (first.status_code, again.status_code, other.status_code) == (202, 200, 422)
    assert first.json()["id"] == again.json()["id"]
    assert service.submit(name, headers=key, seed=1).json()["type"] == "/problems/idempotency-key-reused"


def test_what_is_wrong_with_a_request_is_said_at_once(service, name):
    service.venue(name)
    assert problem_of(fit(service, f"{name}-not")) == (404, "venue-not-found")
    assert problem_of(fit(service, name, files=upload()[:1])) == (422, "missing-camera")
    assert problem_of(fit(service, name, {"colour": "red"})) == (422, "invalid-request")
    assert problem_of(service.http.post(f"/venues/{name}/field/fit", json={})) == (415, "not-multipart")


@pytest.mark.parametrize(("behaviour", "code"), [("accept", 0), ("fail", 1), ("reject", 3)])
def test_esc_fits_the_field_of_a_stored_venue(service, esc, name, tmp_path, behaviour, code):
    service.venue(name, behaviour)
    done = esc("field", "fit", name, *FRAMES, "-o", "fitted.json", "--pictures", "seen")
    assert done.returncode == code, done.stderr
    assert (tmp_path / "fitted.json").exists() == (code == 0)
    if code == 0:
        assert "length: 104.250 ± 0.050 m (given 105.000)" in done.stderr
        assert "width: unknowable from these frames, no line seen (kept 68.000)" in done.stderr
        assert (tmp_path / "seen" / "overlay_left.jpg").exists()
        assert esc("venue", "put", "fitted.json").returncode == 0
        assert service.http.get(f"/venues/{name}").json()["field"]["length_m"] == 104.25


def test_neither_a_file_nor_an_id_is_a_usage_error(esc):
    done = esc("field", "fit", "No Such.json", *FRAMES, "-o", "fitted.json")
    assert done.returncode == 2
    assert "There is no file No Such.json" in done.stderr
