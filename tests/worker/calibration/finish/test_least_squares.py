"""The rows of the finish: their derivatives are what the offsets change by."""

import numpy as np
import pytest

from tests.worker.calibration.finish.test_uncertainty import measured
from tests.worker.calibration.scene.differences import assert_alike
from tests.worker.calibration.synthetic import CROWNED, camera
from worker.calibration.finish.least_squares import rows_of
from worker.calibration.finish.unknowns import Unknowns
from worker.calibration.scene.ground import Ground
from worker.calibration.scene.lens import Fisheye
from worker.calibration.scene.motion import POSE_NUMBERS
from worker.calibration.scene.parameters import field_parameters, lens_parameters


def pinhole():
    return camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0), distortion=(-0.28, 0.08, 1e-3, -2e-3, 0.01))


def fisheye():
    one = camera("dome", (2.0, -40.0, 9.0), (0.0, 0.0), focal=300.0)
    return one.with_lens(Fisheye(one.intrinsics.matrix, np.array([-0.02, 0.004, -0.002, 3e-4]), one.intrinsics.size))


@pytest.mark.parametrize("of", [pinhole, fisheye])
def test_the_offsets_change_with_lens_and_field_as_the_rows_say(of):
    one, lines = of(), CROWNED.line_points()
    found = measured(lines, one)
    parameters = [*lens_parameters([one]), *field_parameters(CROWNED)]
    (rows,) = rows_of(lines.position, [one], [found], Unknowns(1, parameters, Ground.under(lines)))

    def offset(parameter, by):
        (there,), pitch = parameter.applied([one], CROWNED, by)
        position = pitch.same_line_points(lines).position
        return rows.measured.offset(there, position[rows.point])

    for column, parameter in enumerate(parameters, POSE_NUMBERS):
        step = 1e-3 * parameter.expected
        expected = (offset(parameter, step) - offset(parameter, -step)) / (2 * step)
        assert_alike(rows.jacobian[:, column], expected, of=0, within=1e-5)
        assert np.abs(expected).max() > 0
