"""What is known of a camera whose pose is sought."""

import numpy as np
import pytest

from testbed.synthetic import camera
from worker.calibration.relocalisation.relocalise import sees_all_of_its_frame
from worker.calibration.relocalisation.sought import (
    BENDS,
    OTHER_BENDS,
    Place,
    SoughtLens,
    lenses_of_view,
    unknown_lenses,
)

LENS = camera("one", (0.0, -48.0, 10.0), (0.0, 0.0)).intrinsics
CORNERS = np.array([[-5.0, -40.0, 8.0], [5.0, -40.0, 8.0], [5.0, 40.0, 8.0]])


def test_a_lens_that_is_known_well_needs_no_search():
    assert SoughtLens.known(LENS).is_known
    assert SoughtLens.around(LENS, 0.01).is_known


def test_a_lens_that_is_known_roughly_is_searched_two_sigma_to_each_side():
    lens = SoughtLens.around(LENS, 0.1)
    assert not lens.is_known
    assert (lens.shortest_px, lens.longest_px) == pytest.approx((600 / 1.2, 600 * 1.2))


def test_a_field_of_view_is_a_focal_length():
    for lens in lenses_of_view((960, 540), 60.0, 0.15):
        edge = lens.lens.undistort([[959.5, 269.5]])
        assert lens.lens.focal_length_px == pytest.approx(480 / np.tan(np.radians(30)))
        assert edge[0, 0] == pytest.approx(np.tan(np.radians(30)), rel=0.15)


def test_lenses_that_nothing_is_known_of_are_wide_and_long_and_of_two_bends():
    straight, barrel = unknown_lenses((960, 540))
    assert straight.shortest_px < 400 < 4000 < straight.longest_px
    assert straight.lens.distortion[0] == 0 > barrel.lens.distortion[0]
    assert not straight.is_bend_known


@pytest.mark.parametrize("bend", [*BENDS, *OTHER_BENDS])
def test_lenses_of_every_bend_that_is_tried_see_all_of_their_frame(bend):
    for size in ((960, 540), (1280, 1280)):
        (unknown,) = unknown_lenses(size, [bend])
        (of_view,) = lenses_of_view(size, 100.0, 0.15, [bend])
        assert sees_all_of_its_frame(unknown.lens)
        assert sees_all_of_its_frame(of_view.lens)


def test_a_given_lens_bends_as_it_is_given():
    assert SoughtLens.known(LENS).is_bend_known
    assert SoughtLens.around(LENS, 0.1).is_bend_known


@pytest.mark.parametrize(
    ("side", "allowed"),
    [("near", [1, 1, 0]), ("far", [0, 0, 1]), ("left", [1, 0, 0]), ("right", [0, 1, 1]), (None, [1, 1, 1])],
)
def test_a_side_of_the_field_is_a_half_of_the_world(side, allowed):
    assert Place(side).allows(CORNERS).tolist() == allowed


def test_a_rough_position_allows_what_is_near_it():
    assert Place(position=np.array([4.0, -40.0, 8.0]), radius_m=2.0).allows(CORNERS).tolist() == [0, 1, 0]
    assert Place("left", np.array([4.0, -40.0, 8.0]), 20.0).allows(CORNERS).tolist() == [1, 0, 0]
