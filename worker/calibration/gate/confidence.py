"""Confidence: how probable it is that a pose explains its frame, rather than that other lines fit by chance.

Two questions are asked of the frame. How many of the expected lines are found, beyond those that chance would find
(the agreement)? And how many, if all paint on the field that no line explains counts as line that was expected and not
found? And one of the stored pose: how far would the camera have moved? Farther off there are more poses that some lines
fit. The log odds of the pose are a weighted sum of the log odds of the first two answers and the logarithm of the
third. Pieces of line are no further witnesses: what misleads one of them (a floor of several sports, a shadow, a fence)
misleads its neighbours.
"""

import numpy as np

WEIGHTS = (4.5, 1.4, 0.6, -2.5)
"""Weights of a constant, of both log odds and of the logarithm of the motion by logistic regression (Platt, 1999) of
right answers: `python -m benchmarks.confidence`."""
WEIGHTS_WITHOUT_MOTION = (-0.9, 2.3, 3.3)
"""Weights where nothing is known of the motion, as of a pose that was found in the frame itself; by the same
regression on half of 202 earlier answers."""
LEAST_SHARE = 0.01
"""Share of lines that something else always hides, or fits: no answer is surer than that."""


def confidence_of(agreement: float, unexplained: float, motion: float | None) -> float:
    """Return the probability 0..1 that a pose is right, by `Evidence.agreement` and `Overlap.unexplained`.

    `motion`: `Moved.scale` from the stored pose; None where none is known but from the frame.
    """
    weights = WEIGHTS_WITHOUT_MOTION if motion is None else WEIGHTS
    return float(1 / (1 + np.exp(-np.dot(weights, witnesses(agreement, unexplained, motion)))))


def witnesses(agreement: float, unexplained: float, motion: float | None) -> list[float]:
    """Return what the weights are of, the motion last where one is known; arguments as of `confidence_of`."""
    by_frame = [1.0, logit(agreement), logit(agreement / (1 + unexplained))]
    return by_frame if motion is None else [*by_frame, float(np.log(motion))]


def logit(share: float) -> float:
    """Return the log odds of a share 0..1, in nats."""
    share = float(np.clip(share, LEAST_SHARE, 1 - LEAST_SHARE))
    return float(np.log(share / (1 - share)))
