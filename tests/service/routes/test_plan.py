"""Plans of cameras before they are mounted, by HTTP."""

import base64

import cv2
import numpy as np
import pytest

from service.schemas.plan import PlanAnswer
from testbed.running import venue
from tests.problems import problem_of

CAMERA = {"id": "end", "image_size": [1920, 1080], "position": [0.0, -14.0, 6.0], "look_at": [0.0, 0.0]}
SITE = {"field": {"template": "volleyball"}, "cameras": [CAMERA | {"field_of_view_deg": 80}]}


def test_a_plan_has_numbers_maps_and_pictures_and_stores_nothing(service):
    before = service.http.get("/venues").json()["venues"]
    answer = service.http.post("/plan", json=SITE).raise_for_status()
    made = PlanAnswer.model_validate(answer.json())
    (camera,) = made.plan.cameras
    assert (camera.id, camera.calibratable) == ("end", True)
    assert 0 < camera.place_m.median < 0.1
    assert camera.px_per_metre.median == pytest.approx(np.nanmedian(np.array(made.maps.px_per_metre, float)), rel=0.01)
    for picture in made.pictures.values():
        drawn = cv2.imdecode(np.frombuffer(base64.b64decode(picture), np.uint8), cv2.IMREAD_COLOR)
        assert drawn.std() > 10
    assert service.http.get("/venues").json()["venues"] == before


@pytest.mark.long
def test_covered_lines_and_worn_ones_make_a_plan_worse(service):
    clean, poor = (
        service.http.post("/plan", params=asked, json=SITE).json()["plan"]
        for asked in ({}, {"lines": "worn", "hidden": 0.5})
    )
    assert (poor["lines"], poor["hidden"]) == ("worn", 0.5)
    first, second = (one["cameras"][0]["measurement_sigma"]["position_m"] for one in (clean, poor))
    assert second > 1.2 * first


def test_a_stored_venue_is_a_plan(service, name):
    service.venue(name)
    stored = service.http.get(f"/venues/{name}").json()
    made = service.http.post("/plan", json=stored).raise_for_status().json()
    assert [camera["id"] for camera in made["plan"]["cameras"]] == [camera["id"] for camera in venue(name)["cameras"]]


@pytest.mark.parametrize(
    ("site", "words"),
    [
        (SITE | {"cameras": []}, "a plan needs cameras, or stands to propose cameras for"),
        (SITE | {"cameras": [CAMERA]}, "camera end needs one lens"),
        (SITE | {"cameras": [SITE["cameras"][0] | {"id": f"c{n}"} for n in range(13)]}, "at most 12 cameras, got 13"),
    ],
)
def test_a_plan_that_cannot_be_made_says_what_is_missing(service, site, words):
    refused = service.http.post("/plan", json=site)
    assert problem_of(refused) == (422, "invalid-request")
    assert words in refused.json()["detail"]
