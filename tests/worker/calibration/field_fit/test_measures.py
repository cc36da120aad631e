"""Measures of a pitch from its lines: found where they can be, and declared unknowable where not."""

from functools import cache

import numpy as np
import pytest

from fields.template import Template, load
from testbed.synthetic import (
    BARREL,
    CROWNED,
    PITCH,
    camera,
    moved,
    pair,
    pair_frames,
)
from tests.worker.calibration.sights import observed
from tests.worker.calibration.test_calibrate import white_on_green
from worker.calibration.field_fit.measures import QUANTITIES, fit_field, fit_measures
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import field_parameters

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def fitted(truth, cameras, given):
    """The pitch that the lines of `truth` make of a `given` one, by cameras a little off, and its measures by name."""
    start = [moved(c, (0.0008, -0.0006, 0.0005), (0.02, -0.03, 0.02)) for c in cameras]
    refined, measures = fit_measures(given, start, observed(truth, cameras), 0.5)
    return refined, {measure.name: measure for measure in measures}


@cache
def centre_only():
    one = camera("centre", (0.0, -30.0, 8.0), (0.0, 0.0), focal=900.0, distortion=BARREL)
    return fitted(PITCH, [one], Field(104.0, 67.5))


WHOLE_COURT = camera("whole", (0.0, -11.0, 6.0), (0.0, -1.0), focal=420.0)


def test_a_court_that_is_shorter_and_narrower_than_said_is_found():
    truth, given = Field(23.7, 10.9, 0.05, template=load("tennis")), Field(23.77, 10.97, 0.05, template=load("tennis"))
    refined, measures = fitted(truth, [WHOLE_COURT], given)
    for name, real in (("length_m", 23.7), ("width_m", 10.9)):
        assert measures[name].known, name
        assert abs(measures[name].value - real) < 3 * measures[name].sigma < 0.05, name
    assert (refined.pitch.length, refined.pitch.width) == (measures["length_m"].value, measures["width_m"].value)


def test_the_ridge_of_a_short_court_is_found_though_it_was_given_five_times_as_long():
    truth = Field(23.77, 10.97, 0.05, np.array([[-2.0, 0.0, 0.15], [2.0, 0.0, 0.15]]), load("tennis"))
    _, measures = fitted(truth, [WHOLE_COURT], truth.with_ridge_length(20.0))
    for name, real in (("width_m", 10.97), ("ridge_height_m", 0.15), ("ridge_length_m", 4.0)):
        assert measures[name].known, name
        assert abs(measures[name].value - real) < 3 * measures[name].sigma, name


@pytest.mark.long
@pytest.mark.parametrize(("name", "given"), [("length_m", 104.0), ("width_m", 67.5)])
def test_what_no_line_in_view_depends_on_is_unknowable_and_stays(name, given):
    refined, measures = centre_only()
    assert not measures[name].known
    assert "in view" in measures[name].detail
    assert measures[name].given == given
    assert (refined.pitch.length, refined.pitch.width) == (104.0, 67.5)


def test_markings_of_ones_own_are_where_their_coordinates_say_and_it_is_said_so():
    lines = {"north": [[-20, 10], [20, 10]], "south": [[-20, -10], [20, -10]], "across": [[-20, -10], [-20, 10]]}
    own = Template(marking=[{"name": name, "line": line} for name, line in lines.items()])
    court = Field(40.0, 20.0, 0.12, template=own)
    opposite = camera("whole", (-5.0, -25.0, 12.0), (-5.0, 0.0), focal=500.0)
    refined, measures = fitted(court, [opposite], court)
    for name in ("length_m", "width_m"):
        assert not measures[name].known
        assert measures[name].detail == "markings of your own lie where their coordinates say, whatever the measure"
    assert (refined.pitch.length, refined.pitch.width) == (40.0, 20.0)


@pytest.mark.long
def test_a_flat_pitch_has_no_ridge_worth_mentioning_and_none_whose_length_could_be_told():
    refined, measures = centre_only()
    height, length = measures["ridge_height_m"], measures["ridge_length_m"]
    assert abs(height.value) < 2 * height.sigma
    assert refined.pitch.ridge_height == pytest.approx(0.0, abs=0.03)
    assert not length.known
    assert "from 0 to 104 m" in length.detail


def test_where_one_camera_sees_nothing_no_measure_is_known_and_it_alone_is_named():
    left, right = pair_frames()
    frames = {"left": [left], "right": [np.zeros_like(right)]}
    found = fit_field(CROWNED, pair(), frames, white_on_green, 1)
    assert found.rejected_because.startswith("camera right: Dark")
    assert "camera left" not in found.rejected_because
    assert found.cameras[1].moved.position_m == 0.0
    assert (found.pitch.length, found.pitch.width) == (105.0, 68.0)
    assert [measure.known for measure in found.measures] == [False] * 4
    assert found.measures[3].value == found.measures[3].given == 37.0


@pytest.mark.long
def test_a_handball_court_that_is_narrower_than_said_is_found_though_it_has_fewer_dashes():
    truth = Field(39.8, 19.6, 0.05, template=load("handball"))
    given = Field(40.0, 20.0, 0.05, template=load("handball"))
    assert len(truth.markings()) < len(given.markings())
    whole = camera("whole", (0.0, -16.0, 9.0), (0.0, -1.0), focal=420.0)
    refined, measures = fitted(truth, [whole], given)
    assert refined.pitch.length == pytest.approx(39.8, abs=0.03)
    assert refined.pitch.width == pytest.approx(19.6, abs=0.03)
    assert measures["width_m"].known


def test_every_number_that_a_measure_may_be_taken_for_has_a_name():
    assert {*LENS_PARAMETERS, *(one.name for one in field_parameters(PITCH))} == {*QUANTITIES}
