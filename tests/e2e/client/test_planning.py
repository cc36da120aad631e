"""`esc plan`, as somebody calls it before the pole stands."""

import json

import cv2
import pytest

from testbed.synthetic import CROWNED, pair
from testbed.venue_documents import venue_document
from tests.e2e.commands import esc_here

FIELD = {"template": "football"}


def planned(folder, cameras, *more):
    (folder / "site.json").write_text(json.dumps({"field": FIELD, "cameras": cameras}))
    return esc_here(folder, "plan", "site.json", "-o", "out", *more)


@pytest.mark.long
def test_a_plan_is_a_document_maps_in_numbers_and_pictures(tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue_document("ground", CROWNED, pair())))
    said = esc_here(tmp_path, "plan", "venue.json", "-o", "out", "--lines", "worn")
    assert said.returncode == 0, said.stderr
    answer = json.loads((tmp_path / "out" / "plan.json").read_text())
    assert json.loads(said.stdout) == answer
    assert answer["lines"] == "worn"
    maps = json.loads((tmp_path / "out" / "maps.json").read_text())
    assert [len(row) for row in maps["place_m"]] == [len(maps["x_m"])] * len(maps["y_m"])
    sought = json.loads((tmp_path / "out" / "find.json").read_text())
    assert [camera["id"] for camera in sought["cameras"]] == ["left", "right"]
    pictures = {path.name: cv2.imread(str(path)) for path in (tmp_path / "out").glob("*.png")}
    assert {"place.png", "place-left.png", "coverage.png", "pixels-per-metre.png"} <= set(pictures)
    assert all(picture.shape[1] == 1600 for picture in pictures.values())


def test_a_camera_that_cannot_be_calibrated_is_warned_of_and_ends_with_3(tmp_path):
    away = {"id": "away", "image_size": [1920, 1080], "position": [0, -48, 10], "field_of_view_deg": 60}
    said = planned(tmp_path, [away | {"pan_deg": 180, "tilt_deg": -10}])
    assert said.returncode == 3
    assert "Warning: away: no marking of the field is in view" in said.stderr
    assert json.loads(said.stdout)["cameras"][0]["calibratable"] is False


def test_what_is_no_plan_is_refused_in_words(tmp_path):
    said = planned(tmp_path, [{"id": "left", "image_size": [1920, 1080], "position": [0, -48, 10]}])
    assert said.returncode == 2
    assert "camera left needs one direction: look_at, pan_deg with tilt_deg, or a pose" in said.stderr
