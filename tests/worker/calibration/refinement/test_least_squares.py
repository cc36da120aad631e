"""The rows of the finish: derivatives are what the offsets change by, and paint is summed out of them exactly."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.synthetic import CROWNED, camera
from tests.worker.calibration.geometry.differences import assert_alike
from tests.worker.calibration.refinement.test_uncertainty import measured
from worker.calibration.detection.line_measurement import PAINT_M
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.lens import Fisheye
from worker.calibration.geometry.parameters import field_measures, field_parameters, lens_parameters
from worker.calibration.refinement.least_squares import normal_equations, rows_of, weigh_rows
from worker.calibration.refinement.unknowns import Unknowns


def pinhole():
    return camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0), distortion=(-0.28, 0.08, 1e-3, -2e-3, 0.01))


def fisheye():
    one = camera("dome", (2.0, -40.0, 9.0), (0.0, 0.0), focal=300.0)
    return one.with_lens(Fisheye(one.intrinsics.matrix, np.array([-0.02, 0.004, -0.002, 3e-4]), one.intrinsics.size))


@pytest.mark.parametrize("of", [pinhole, fisheye])
def test_the_offsets_change_with_lens_and_field_as_the_rows_say(of):
    one, lines = of(), CROWNED.line_points()
    found = measured(lines, one)
    parameters = [*lens_parameters([one]), *field_measures(CROWNED)]
    (rows,) = rows_of(lines.position, [one], [found], Unknowns(1, parameters, Ground.under(lines)))

    def offset(parameter, by):
        (there,), pitch = parameter.applied([one], CROWNED, by)
        position = pitch.measured_points.position
        return rows.measured.offset(there, position[rows.point])

    for column, parameter in enumerate(parameters, POSE_NUMBERS):
        step = 1e-3 * parameter.expected
        expected = (offset(parameter, step) - offset(parameter, -step)) / (2 * step)
        assert_alike(rows.jacobian[:, column], expected, of=0, within=1e-5)
        assert np.abs(expected).max() > 0


def two_views():
    """The rows of two cameras that see many of the same line points, each with noise, and the ground under them."""
    lines = CROWNED.line_points(0.5)
    cameras = [pinhole(), camera("right", (3.0, -46.0, 11.0), (-14.0, 0.0))]
    rng = np.random.default_rng(4)
    exact = [measured(lines, one) for one in cameras]
    found = [
        replace(its, pixel=its.pixel + rng.normal(0, 0.3, len(its))[:, None] * its.normal, misfit_px=0.0)
        for its in exact
    ]
    unknowns = Unknowns(2, field_parameters(CROWNED), Ground.under(lines))
    return rows_of(lines.position, cameras, found, unknowns), unknowns


def test_paint_is_eliminated_as_if_it_had_been_solved_for():
    rows, unknowns = two_views()
    level = np.random.default_rng(5).normal(0, 0.01, len(unknowns.ground))
    of = weigh_rows(rows, level, unknowns, np.ones_like)
    assert of.shared.sum() > 200
    ours = normal_equations(of)

    # Every row by every unknown, and by what its line point is off by, if another view sees that too.
    shared = np.unique(of.at[of.shared])
    size, count = len(unknowns), len(of.at)
    whole = np.zeros((count, size + 2 * len(shared)))
    for its, part in zip(of.rows, of.parts(), strict=True):
        whole[part, its.columns] = its.jacobian
    nodes, shares = unknowns.ground.node[of.points[of.at]], unknowns.ground.share[of.points[of.at]]
    for corner in range(4):
        whole[np.arange(count), unknowns.dense + nodes[:, corner]] -= of.local[:, 1] * shares[:, corner]
    for row in np.flatnonzero(of.shared):
        at = size + 2 * int(np.searchsorted(shared, of.at[row]))
        whole[row, at : at + 2] = -of.local[row]
    known = np.diag(np.concatenate([np.zeros(size), np.tile([PAINT_M**-2, unknowns.ground.usual_m**-2], len(shared))]))
    information = (whole * of.weight[:, None]).T @ whole + known
    gradient = whole.T @ (of.weight * of.residual)
    effect = np.linalg.solve(information[size:, size:], information[size:, :size])
    expected = information[:size, :size] - information[:size, size:] @ effect
    scale = np.sqrt(np.maximum(np.diag(expected), 1e-12))
    assert np.abs((ours.information - expected) / np.outer(scale, scale)).max() < 1e-9
    assert_alike(ours.gradient, gradient[:size] - effect.T @ gradient[size:], of=0, within=1e-9)


def test_a_point_that_two_views_see_says_less_of_where_both_stand_than_two_points():
    rows, unknowns = two_views()
    level = np.zeros(len(unknowns.ground))
    of = weigh_rows(rows, level, unknowns, np.ones_like)
    together = np.tile(np.eye(6), (2, 1))

    def of_both(which):
        information = normal_equations(weigh_rows(which, level, unknowns, np.ones_like)).information[:12, :12]
        return together.T @ information @ together

    apart = of_both(rows[:1]) + of_both(rows[1:])
    assert of.shared.any()
    assert (np.linalg.eigvalsh(apart - of_both(rows)) > -1e-6 * np.linalg.norm(apart)).all()
