"""A site with cameras that are not mounted yet, from its document to the engine."""

import numpy as np
import pytest
from pydantic import ValidationError

from service.formats.opentrackio import AHEAD_IS_Y, pan_tilt_roll
from service.schemas.find import SoughtSite
from service.schemas.plan import PlannedSite, PlanResult
from testbed.synthetic import CROWNED, PITCH, pair
from testbed.venue_documents import venue_document
from worker.jobs import planning

CAMERA = {"id": "left", "image_size": [1920, 1080], "position": [-2.0, -48.0, 12.0]}
AIMED = CAMERA | {"look_at": [-20.0, 0.0], "field_of_view_deg": 70}


def site(*cameras):
    return PlannedSite.model_validate({"field": {"template": "football"}, "cameras": list(cameras)})


def placed(given):
    return planning.camera_of(PITCH, site(given).cameras[0])


def test_a_field_of_view_and_a_focal_length_on_a_sensor_are_the_same_lens():
    one = placed(AIMED)
    sensor = {name: value for name, value in AIMED.items() if name != "field_of_view_deg"}
    width_mm = 2 * 5.0 * float(np.tan(np.radians(35)))
    other = placed(sensor | {"focal_length_mm": 5.0, "sensor_width_mm": width_mm})
    np.testing.assert_allclose(one.intrinsics.matrix, other.intrinsics.matrix)
    rays = one.intrinsics.undistort([[-0.5, 540.0], [1919.5, 540.0]])
    assert float(np.degrees(np.arctan(rays[1, 0]) - np.arctan(rays[0, 0]))) == pytest.approx(70.0)


def test_a_camera_looks_at_the_point_that_it_is_to_look_at():
    one = placed(AIMED)
    np.testing.assert_allclose(one.project(np.array([-20.0, 0.0, 0.0])), one.intrinsics.matrix[:2, 2], atol=1e-6)


def test_pan_tilt_and_roll_are_those_that_a_tracker_would_send():
    one = placed(CAMERA | {"pan_deg": 30.0, "tilt_deg": -14.0, "roll_deg": 3.0, "field_of_view_deg": 70})
    pan, tilt, roll = np.degrees(pan_tilt_roll((one.pose.matrix.T @ np.array(AHEAD_IS_Y).T).tolist()))
    assert (-pan, tilt, roll) == pytest.approx((30.0, -14.0, 3.0))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (CAMERA | {"field_of_view_deg": 70}, "camera left needs one direction"),
        (AIMED | {"pan_deg": 0.0, "tilt_deg": -10.0}, "camera left needs one direction"),
        (CAMERA | {"pan_deg": 0.0, "field_of_view_deg": 70}, "camera left needs one direction"),
        (CAMERA | {"look_at": [0.0, 0.0]}, "camera left needs one lens"),
        (AIMED | {"focal_length_mm": 4.0}, "camera left needs one lens"),
        (
            CAMERA | {"look_at": [0.0, 0.0], "focal_length_mm": 0.001, "sensor_width_mm": 8.0},
            "expected a field of view of 2 to 150 degrees, focal_length_mm and sensor_width_mm make 180",
        ),
        (AIMED | {"position": [0.0, 0.0, -1.0]}, "must be above the pitch"),
        (AIMED | {"position": [-20.0, 0.0, 12.0]}, "looks straight down"),
    ],
)
def test_a_camera_with_half_a_place_or_two_lenses_is_refused_in_words(given, words):
    with pytest.raises(ValidationError, match=words):
        site(given)


@pytest.mark.long
def test_a_whole_venue_is_planned_at_its_stored_poses():
    venue = venue_document("ground", CROWNED, pair())
    found = planning.solve(PlannedSite.model_validate(venue), "worn", 0.1)
    assert [camera.id for camera in found.result.cameras] == ["left", "right"]
    assert found.result.calibratable
    assert {"halfway line", "centre circle"} <= set(found.result.pairs[0].markings_m)
    assert sum(found.result.covered.values()) == pytest.approx(1.0, abs=1e-3)
    assert len(found.maps.place_m) == len(found.maps.y_m)
    pictures = planning.draw_field_maps(found.plan) | planning.draw_camera_maps(found.plan)
    assert pictures.keys() == {"place", "coverage", "pixels-per-metre", "place-left", "place-right"}


def test_a_stand_gets_cameras_and_the_plan_is_a_site_to_search_for_them():
    stand = {"id": "mast", "position": [0.0, -12.0, 5.0], "cameras": 2, "image_size": [1920, 1080]}
    place = PlannedSite.model_validate({"field": {"template": "volleyball"}, "stands": [stand]})
    found = planning.solve(place, "fresh", 0.0).result
    assert [camera.id for camera in found.cameras] == ["mast-1", "mast-2"]
    assert found.cameras[0].pan_deg < 0 < found.cameras[1].pan_deg
    sought = SoughtSite.model_validate_json(place.to_sought(found).model_dump_json(exclude_none=True))
    assert sought.sought == ["mast-1", "mast-2"]
    assert sought.cameras[0].field_of_view_deg == found.cameras[0].field_of_view_deg


@pytest.mark.parametrize(
    "camera",
    [
        # Its rays end before the edges of the picture.
        {"intrinsics": {"matrix": [[1e3, 0, 959.5], [0, 1e3, 539.5], [0, 0, 1]], "distortion": [-2.0, 0.08, 0, 0]}},
        # It sees a mark, and no cell of the map.
        {"field_of_view_deg": 2, "image_size": [1920, 64], "position": [-1.0, 0.0, 300.0], "look_at": [0.0, -1.0]},
    ],
)
def test_a_lens_without_edges_and_a_view_of_a_spot_have_a_plan_of_numbers_alone(camera):
    given = {"field": {"template": "hockey"}, "cameras": [CAMERA | {"look_at": [0.0, 0.0]} | camera]}
    found = planning.solve(PlannedSite.model_validate(given), "fresh", 0.0).result
    assert PlanResult.model_validate_json(found.model_dump_json()) == found


def test_a_plan_of_nothing_is_refused():
    with pytest.raises(ValidationError, match="needs cameras, or stands"):
        PlannedSite.model_validate({"field": {"template": "football"}})
