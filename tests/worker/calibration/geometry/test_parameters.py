"""What is expected to be wrong with fields, by what is said of them."""

import pytest

from fields.template import load
from testbed.synthetic import TAPED
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import field_parameters


def expected(field):
    return {parameter.name: parameter.expected for parameter in field_parameters(field)}


def test_a_size_that_each_ground_chooses_is_known_as_well_as_its_digits():
    assert expected(Field(105.0, 68.0))["length_m"] == pytest.approx(0.2887, abs=1e-4)
    assert expected(Field(104.5, 68.25)) == expected(Field(104.5, 68.25)) | {
        "length_m": pytest.approx(0.0314, abs=1e-4),
        "width_m": pytest.approx(0.0205, abs=1e-4),
    }
    # A hundred metres are no less exact than a hundred and five.
    assert expected(Field(100.0, 60.0))["length_m"] == expected(Field(105.0, 60.0))["length_m"]


def test_a_size_that_the_rules_fix_or_somebody_measured_is_a_tapes():
    court = Field(18.0, 9.0, 0.05, template=load("volleyball"))
    assert expected(court)["length_m"] == pytest.approx(0.0054)
    measured = expected(Field(105.0, 68.0, sigma=TAPED))
    assert (measured["length_m"], measured["width_m"]) == (0.03, 0.02)
    assert measured["skew_m"] < 0.6 * expected(Field(105.0, 68.0))["skew_m"]
