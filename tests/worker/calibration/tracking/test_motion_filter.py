"""What stands still is held still, what goes on is followed, what cannot be is noticed, and sigma is what it says."""

import numpy as np
import pytest

from worker.calibration.tracking.motion_filter import (
    BACK_M,
    BACK_RAD,
    GATE,
    FilterStep,
    PoseObservation,
    State,
    smoothed,
)

FRAME_S = 0.04
NOISE = np.repeat([np.radians(0.004), 0.004], 3)
INFORMATION = np.diag(NOISE**-2.0)
RATE = np.array([0.02, -0.01, 0.015, 0.05, -0.04, 0.02])


def filtered(changes, rng=None):
    """The steps of a filter that sees changes (T, 6), with noise if there is an `rng`."""
    last = State.at_reference(INFORMATION)
    steps = [FilterStep(0.0, last)]
    for change in changes:
        seen = change if rng is None else change + rng.normal(0, NOISE)
        expected = last.after(FRAME_S).with_mast_prior(FRAME_S)
        last = expected.with_observed(PoseObservation(seen, INFORMATION))
        steps.append(FilterStep(FRAME_S, last))
    return steps


def in_sigmas(states, changes):
    """Mean squared error in its own standard deviations, per number."""
    errors = [(state.change - change, state.change_covariance) for state, change in zip(states, changes, strict=True)]
    return np.mean([error @ np.linalg.solve(covariance, error) / 6 for error, covariance in errors])


def swinging(count):
    """0.3 degrees and 2 cm at 0.5 Hz."""
    phase = np.pi * FRAME_S * np.arange(1, count + 1)[:, None] + np.arange(6)
    return np.sin(phase) * np.repeat([np.radians(0.3), 0.02], 3)


def test_a_rig_that_stands_still_stays_still_within_its_sigma():
    steps = filtered(np.zeros((500, 6)), np.random.default_rng(1))
    assert in_sigmas([step.state for step in steps[50:]], np.zeros((451, 6))) < 1.0
    calm = np.std([state.change for state in smoothed(steps)[50:-50]], axis=0)
    assert np.all(calm < 0.8 * NOISE)


def test_a_swinging_rig_is_followed_within_its_sigma():
    changes = swinging(500)
    steps = filtered(changes, np.random.default_rng(2))
    known = [step.state for step in steps[50:]]
    assert in_sigmas(known, changes[49:]) < 1.1
    errors = np.array([state.change for state in known]) - changes[49:]
    assert np.all(np.sqrt(np.mean(errors**2, axis=0)) < NOISE)


def test_what_goes_on_as_it_went_is_followed_without_a_lag():
    changes = RATE * FRAME_S * np.arange(1, 51)[:, None]
    last = filtered(changes)[-1].state
    assert np.all(np.abs(last.change - changes[-1]) < 0.1 * NOISE)
    np.testing.assert_allclose(last.mean[6:], RATE, rtol=0.02)


def test_who_sees_what_comes_later_knows_more():
    changes = swinging(200)
    steps = filtered(changes, np.random.default_rng(3))
    later = smoothed(steps)
    for step, state in zip(steps, later, strict=True):
        assert np.all(np.diag(state.covariance) <= np.diag(step.state.covariance) * (1 + 1e-9))
    error, error_then = (
        np.mean(np.square([state.change - change for state, change in zip(states[1:], changes, strict=True)]))
        for states in (later, [step.state for step in steps])
    )
    assert error < 0.8 * error_then
    np.testing.assert_array_equal(later[-1].mean, steps[-1].state.mean)


def test_smoothed_states_are_those_of_least_squares_over_all_moments_at_once():
    # Unknowns are the first state and what disturbs each step, each as twelve standard normal variables.
    changes, certain = swinging(5), np.zeros((12, 12))
    values, vectors = np.linalg.eigh(State(np.zeros(12), certain).after(FRAME_S).covariance)
    disturbance = vectors * np.sqrt(np.maximum(values, 0.0))
    transition = np.column_stack([State(unit, certain).after(FRAME_S).mean for unit in np.eye(12)])
    jacobians = [np.eye(12, 12 * 6)]
    jacobians[0][:, :12] = np.linalg.cholesky(State.at_reference(INFORMATION).covariance)
    for step in range(1, 6):
        jacobians.append(transition @ jacobians[-1])
        jacobians[-1][:, 12 * step : 12 * step + 12] = disturbance
    mast = np.diag(np.repeat([BACK_RAD, BACK_M], 3) ** -2.0) * FRAME_S
    seen = [jacobian[:6] for jacobian in jacobians[1:]]
    covariance = np.linalg.inv(np.eye(12 * 6) + sum(rows.T @ (INFORMATION + mast) @ rows for rows in seen))
    gradient = sum(rows.T @ INFORMATION @ change for rows, change in zip(seen, changes, strict=True))
    for state, jacobian in zip(smoothed(filtered(changes)), jacobians, strict=True):
        expected = jacobian @ covariance @ jacobian.T
        sigma = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(
            state.covariance / np.outer(sigma, sigma), expected / np.outer(sigma, sigma), atol=1e-6
        )
        np.testing.assert_allclose(state.mean / sigma, jacobian @ covariance @ gradient / sigma, atol=1e-6)


def test_surprise_is_as_large_as_chance_has_it_and_a_jump_exceeds_the_gate():
    rng = np.random.default_rng(4)
    state = filtered(np.zeros((50, 6)))[-1].state.after(FRAME_S)
    spread = np.linalg.cholesky(state.change_covariance + np.diag(NOISE**2))
    found = [
        state.squared_innovation(PoseObservation(state.change + spread @ rng.normal(size=6), INFORMATION))
        for _ in range(2000)
    ]
    assert np.mean(found) == pytest.approx(6, rel=0.1)
    assert max(found) < GATE
    jump = np.radians([0.5, 0, 0, 0, 0, 0])
    assert state.squared_innovation(PoseObservation(state.change + jump, INFORMATION)) > GATE


def test_a_direction_of_which_nothing_is_seen_stays_as_it_was():
    state = filtered(np.zeros((50, 6)))[-1].state.after(FRAME_S)
    blind = INFORMATION.copy()
    blind[4] = blind[:, 4] = 0
    known = state.with_observed(PoseObservation(np.full(6, 1e-4), blind))
    assert known.mean[4] == pytest.approx(state.mean[4], abs=1e-15)
    assert known.covariance[4, 4] == pytest.approx(state.covariance[4, 4])
    assert known.covariance[3, 3] < state.covariance[3, 3]


def test_a_reference_that_hardly_any_line_holds_is_known_as_little():
    state = State.at_reference(np.zeros((6, 6)))
    assert np.degrees(np.sqrt(state.covariance[0, 0])) == pytest.approx(0.3)


def test_a_rig_that_is_not_seen_for_long_is_somewhere_about_its_reference():
    state = filtered(swinging(100))[-1].state
    sigmas = []
    for _ in range(100):
        state = state.after(FRAME_S).with_mast_prior(FRAME_S)
        sigmas.append(np.sqrt(np.diag(state.change_covariance)))
    assert np.all(sigmas[12] > 10 * NOISE)
    assert np.all(np.degrees(sigmas[-1][:3]) < 1.5)
    assert np.all(np.degrees(np.abs(state.change[:3])) < 0.01)
