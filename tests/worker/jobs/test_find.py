"""What a search is told of panoramas, and what it says of those that nobody declared."""

import numpy as np
import pytest
from pydantic import ValidationError

from service.schemas.find import SoughtCameraIn
from worker.calibration.geometry.panorama import Cylindrical, Equirectangular
from worker.jobs.find import sought_camera

SIZE = (3840, 1080)


def test_a_declared_panorama_is_searched_around_its_field_of_view_and_its_lens_found_with_the_pose():
    asked = SoughtCameraIn(id="a", panorama="equirectangular", field_of_view_deg=180)
    (sought,) = sought_camera(asked, SIZE).lenses
    assert isinstance(sought.lens, Equirectangular)
    assert not sought.is_known
    assert sought.longest_px == pytest.approx(SIZE[0] / np.pi * 1.1)
    assert sought.shortest_px == pytest.approx(SIZE[0] / np.pi / 1.1)


@pytest.mark.parametrize(("sigma", "is_sought"), [({"fx": 4.0}, False), ({"fx": 60.0}, True), (None, True)])
def test_a_panorama_with_its_lens_is_searched_through_that_or_near_it(sigma, is_sought):
    matrix = [[1222.0, 0, 1919.5], [0, 1222.0, 539.5], [0, 0, 1]]
    lens = {"model": "cylindrical", "matrix": matrix, "distortion": [], "sigma": sigma}
    sought = sought_camera(SoughtCameraIn.model_validate({"id": "a", "image_size": SIZE, "intrinsics": lens}), SIZE)
    assert sought.is_lens_sought == is_sought


def test_a_frame_wider_than_any_sensor_is_tried_as_a_panorama_if_no_lens_is_given():
    assert any(isinstance(one.lens, Cylindrical) for one in sought_camera(SoughtCameraIn(id="a"), SIZE).other_lenses)
    usual = sought_camera(SoughtCameraIn(id="a"), (3840, 2160))
    assert not any(isinstance(one.lens, Cylindrical) for one in [*usual.lenses, *usual.other_lenses])


@pytest.mark.parametrize(
    ("camera", "why"),
    [
        ({"field_of_view_deg": 180}, "camera a sees 180°: 150° at most for one lens; say which panorama"),
        ({"panorama": "conical"}, "panorama"),
        ({"panorama": "cylindrical", "field_of_view_deg": 359}, "less than or equal to 358"),
    ],
)
def test_views_that_no_lens_has_are_refused(camera, why):
    with pytest.raises(ValidationError, match=why):
        SoughtCameraIn.model_validate({"id": "a", **camera})
