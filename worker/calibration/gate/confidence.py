"""Confidence: how probable it is that a pose explains its frame, rather than that other lines fit by chance.

Two witnesses see the frame. The agreement asks along the expected lines, how much more of them is found than chance
would find; the intersection over union asks the other way, too: how much paint on the field no line explains. The log
odds of the pose are a weighted sum of the log odds of both. Pieces of line are no further witnesses: what misleads one
of them (a floor of several sports, a shadow, a fence) misleads its neighbours, and with ten times the lines a wrong
pose is no less likely to find 0.6 of them.
"""

from __future__ import annotations

import numpy as np

BIAS, OF_AGREEMENT, OF_IOU = 0.27, 1.45, 1.81
"""Logistic regression (Platt, 1999) of right answers on both log odds: `python -m benchmarks.confidence`."""
LEAST_SHARE = 0.01
"""Share of lines that something else always hides, or fits: no witness alone is surer than that."""


def confidence_of(agreement: float, iou: float) -> float:
    """Return the probability 0..1 that a pose is right, by `Evidence.agreement` and `Overlap.iou` (0..1)."""
    odds = BIAS + OF_AGREEMENT * logit(agreement) + OF_IOU * logit(iou)
    return float(1 / (1 + np.exp(-odds)))


def logit(share: float) -> float:
    """Return the log odds of a share 0..1, in nats."""
    share = float(np.clip(share, LEAST_SHARE, 1 - LEAST_SHARE))
    return float(np.log(share / (1 - share)))
