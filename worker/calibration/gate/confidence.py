"""Confidence: how probable it is that a pose explains its frame, rather than that other lines fit by chance.

Two questions are asked of the frame. How many of the expected lines are found, beyond those that chance would find
(the agreement)? And how many, if all paint on the field that no line explains counts as line that was expected and not
found? The log odds of the pose are a weighted sum of the log odds of both answers. Pieces of line are no further
witnesses: what misleads one of them (a floor of several sports, a shadow, a fence) misleads its neighbours.
"""

import numpy as np

BIAS, OF_AGREEMENT, OF_EXPLAINED = -0.9, 2.3, 3.3
"""Logistic regression (Platt, 1999) of right answers on both log odds: `python -m benchmarks.confidence`."""
LEAST_SHARE = 0.01
"""Share of lines that something else always hides, or fits: no answer is surer than that."""


def confidence_of(agreement: float, unexplained: float) -> float:
    """Return the probability 0..1 that a pose is right, by `Evidence.agreement` and `Overlap.unexplained`."""
    odds = BIAS + OF_AGREEMENT * logit(agreement) + OF_EXPLAINED * logit(agreement / (1 + unexplained))
    return float(1 / (1 + np.exp(-odds)))


def logit(share: float) -> float:
    """Return the log odds of a share 0..1, in nats."""
    share = float(np.clip(share, LEAST_SHARE, 1 - LEAST_SHARE))
    return float(np.log(share / (1 - share)))
