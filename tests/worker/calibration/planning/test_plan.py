"""What a plan says of cameras that nobody has mounted yet."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fields.template import load
from testbed.simulated_nights import Painted, SimulatedSight
from testbed.synthetic import TAPED, camera, pair
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import lens_parameters, with_lens_changed
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.planning.ground_errors import ground_error_jacobian
from worker.calibration.planning.line_state import STATES, LineState, expect_measurements
from worker.calibration.planning.plan import plan
from worker.calibration.refinement.expected_errors import ErrorModel
from worker.calibration.refinement.refine import refine

PITCH = Field(105.0, 68.0, sigma=TAPED)
SIZE = (1920, 1080)
FRESH = STATES["fresh"]
FEW = settings(max_examples=3, deadline=None, derandomize=True)


def aimed(name, position, target, focal=1300.0):
    return camera(name, position, target, focal=focal, size=SIZE)


def mirrored(one):
    """The camera on the other side of the halfway line, with its picture turned over."""
    x, y, z = one.pose.position
    over = np.diag([-1.0, 1.0, 1.0])
    rotation = over @ one.pose.matrix @ over
    return Camera(one.id, one.intrinsics, Pose(rotation_vectors(rotation), np.array([-x, y, z])))


def line_sigma(height):
    """Sigma of places on the far touchline by a camera so high, aimed at the middle of the field."""
    planned = plan(PITCH, [aimed("one", (0.0, -48.0, height), (0.0, 0.0))], FRESH)
    return float(np.nanmean(planned.cameras[0].calibrated_m[0]))


@FEW
@given(low=st.floats(6.0, 20.0), more=st.floats(0.5, 10.0))
def test_more_height_never_makes_the_far_line_less_exact(low, more):
    assert line_sigma(low + more) < line_sigma(low)


@FEW
@given(alike=st.floats(1.0, 20.0), more=st.floats(0.1, 20.0), hidden=st.floats(0.01, 0.4))
def test_more_noise_and_more_hidden_lines_never_make_a_measurement_more_exact(alike, more, hidden):
    state, one = LineState(0.9, alike), aimed("one", (-8.0, -48.0, 12.0), (-10.0, 0.0))
    (clear,) = plan(PITCH, [one], state).cameras
    for worse in (plan(PITCH, [one], replace(state, alike=alike + more)), plan(PITCH, [one], state, hidden)):
        (other,) = worse.cameras
        assert np.all(other.measured_m[clear.seen] >= clear.measured_m[clear.seen] * (1 - 1e-9))
        assert other.refined.position_m >= clear.refined.position_m * (1 - 1e-9)


@FEW
@given(x=st.floats(-30.0, 30.0), height=st.floats(7.0, 20.0), aim=st.floats(-25.0, 25.0))
def test_a_mirrored_venue_has_the_mirrored_map(x, height, aim):
    one, other = aimed("one", (x, -48.0, height), (aim, 0.0)), aimed("other", (x + 4, -46.0, height), (aim + 8, 3.0))
    here = plan(PITCH, [one, other], FRESH)
    there = plan(PITCH, [mirrored(one), mirrored(other)], FRESH)
    # Points on the lines are not mirrored themselves: a line begins with one and ends beside one.
    np.testing.assert_allclose(there.place_m, here.place_m[:, ::-1], rtol=0.01)
    assert there.pairs[0].stitch_m == pytest.approx(here.pairs[0].stitch_m, rel=0.01)


@pytest.mark.long
def test_a_calibration_errs_by_what_was_expected():
    """Lens, ground, paint and noise drawn as large as a plan takes them to be; lines measured without pictures."""
    rng = np.random.default_rng(5)
    known = dict.fromkeys(("skew_m", "length_m", "width_m", "ridge_height_m"), 0.001)
    hall = Field(40.0, 20.0, 0.05, None, load("handball"), sigma=known)
    one = aimed("hall", (-4.0, -19.0, 6.0), (-8.0, 0.0))
    measured = expect_measurements(hall.line_points(), one, LineState(1.0, 1.0))
    sigma = ErrorModel(hall, [one]).expect([measured]).as_given
    off = []
    for _ in range(4):
        painted = Painted.drawn(hall, rng)
        real = with_lens_changed(one, np.array([p.expected * rng.normal() for p in lens_parameters([one])]))
        sight = SimulatedSight(painted, [real], 0.2 * rng.normal(size=(1, len(painted.lines))))
        (found,) = refine(hall, [one], sight, 0.5).cameras
        off.append(found.pose.position - one.pose.position)
    assert 0.6 < np.sqrt(np.mean(np.array(off) ** 2 / np.diag(sigma)[3:6])) < 1.5


def test_a_field_that_is_longer_or_wider_than_said_puts_a_place_off_by_its_share_of_it():
    one, points = aimed("one", (0.0, -48.0, 12.0), (0.0, 0.0)), np.array([[10.0, 34.0, 0.0], [-20.0, -17.0, 0.0]])
    unknowns = ErrorModel(PITCH, [one]).unknowns
    off = ground_error_jacobian(PITCH, one, 0, points, unknowns)
    by = {parameter.name: off[..., number] for number, parameter in unknowns.parameters_of(0)}
    np.testing.assert_allclose(by["length_m"], points[:, :2] * [-1 / 105, 0], atol=1e-9)
    np.testing.assert_allclose(by["width_m"], points[:, :2] * [0, -1 / 68], atol=1e-9)


def test_the_ground_in_view_of_two_cameras_is_covered_twice_and_told_alike():
    planned = plan(PITCH, pair(), FRESH)
    (both,) = planned.pairs
    np.testing.assert_array_equal(planned.coverage >= 2, both.seen)
    # On one mast the ground moves both views alike; each of them is off by more than they are apart.
    worst = max(float(np.nanmedian(one.place_m[both.seen])) for one in planned.cameras)
    assert 0 < both.stitch_m < worst
    assert both.line_m.sum() > 50


def test_a_camera_that_sees_no_line_has_a_plan_without_places():
    away = camera("away", (0.0, -48.0, 10.0), (0.0, -150.0))
    planned = plan(PITCH, [away], FRESH)
    assert planned.cameras[0].share == 0.0
    assert planned.cameras[0].markings is None
    assert np.isnan(planned.place_m).all()


def test_pixels_per_metre_are_the_focal_length_over_the_distance():
    one = aimed("one", (0.0, -48.0, 12.0), (0.0, 0.0))
    planned = plan(PITCH, [one], FRESH).cameras[0]
    centre = planned.px_per_metre.shape[0] // 2, planned.px_per_metre.shape[1] // 2
    distance = np.hypot(48.0, 12.0)
    assert planned.px_per_metre[centre] == pytest.approx(1300 / distance, rel=0.05)
    assert planned.px_per_metre_along[centre] == pytest.approx(1300 / distance * 12 / distance, rel=0.08)
