"""Control charts of a series that is measured once a night: has its mean moved beyond what its own spread explains?

Two charts of the standardised values, both two-sided, as in Montgomery, *Introduction to Statistical Quality Control*:
the exponentially weighted moving average (EWMA), which shows where the mean is now, and the tabular cumulative sum
(CUSUM), which adds up small shifts and dates their beginning. Plain numbers in, plain numbers out; the unit is the
caller's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from statistics import median

WEIGHT, LIMIT_SIGMA = 0.2, 3.0
"""Of the EWMA: λ, and the width L of its limits."""
SLACK_SIGMA, DECISION_SIGMA = 0.5, 5.0
"""Of the CUSUM: k, half the shift that it is to find, and h, at which it rings."""
NIGHTS_OF_BASELINE = 20
"""After so many nights it is settled what is usual."""
MAD_TO_SIGMA = 1.4826
"""By which the median distance from the median is one standard deviation of a normal distribution."""


@dataclass(frozen=True)
class Night:
    """A value and what is stated of how well it repeats: one standard deviation, of the value's unit."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Baseline:
    """What is usual: the centre of the values, and the `extra` spread that they have beyond what is stated of each.

    `extra` is what wind and heat do, which no single night knows of. `unsure`: one standard deviation of the centre, in
    those of a night: it is an estimate, and taken for exact it would make charts ring three times as often.
    """

    centre: float
    extra: float
    unsure: float = 0.0

    @classmethod
    def of(cls, nights: Sequence[Night]) -> Baseline:
        """Estimate it from the first nights, robustly: a few that are far off do not move it."""
        first = nights[:NIGHTS_OF_BASELINE]
        values = [night.value for night in first]
        centre = hodges_lehmann(values)
        spread = MAD_TO_SIGMA * median(abs(value - centre) for value in values)
        stated = median(night.sigma for night in first)
        return cls(centre, math.sqrt(max(spread**2 - stated**2, 0.0)), 1 / math.sqrt(len(first)))

    def spread(self, night: Night) -> float:
        """One standard deviation that the value of a night may be off the centre by, never below the stated one."""
        return math.hypot(night.sigma, self.extra)


@dataclass(frozen=True)
class ChartPoint:
    """Where both charts stand after a night, in standard deviations from the centre.

    `standardised`: the value itself; `limit`: of the EWMA's distance from 0, wider from night to night; `high` and
    `low`: the CUSUM's upward and downward sums, both 0 or more; `since`: the number of the night after which the larger
    of them has been above 0, where the shift seems to have begun; None while both are 0.
    """

    standardised: float
    ewma: float
    limit: float
    high: float
    low: float
    since: int | None

    @property
    def is_beyond_ewma(self) -> bool:
        """True while the moving average is outside its limits."""
        return abs(self.ewma) > self.limit

    @property
    def is_beyond_cusum(self) -> bool:
        """True while a cumulative sum is above its decision interval."""
        return max(self.high, self.low) > DECISION_SIGMA

    @property
    def is_beyond(self) -> bool:
        """True while either chart says that the mean has moved."""
        return self.is_beyond_ewma or self.is_beyond_cusum


def charted(nights: Iterable[Night | None], baseline: Baseline) -> Iterator[ChartPoint | None]:
    """Both charts after each night, in order; a night without a value (None) leaves them as they are."""
    ewma = high = low = 0.0
    high_since = low_since = measured = 0
    for number, night in enumerate(nights):
        if night is None:
            yield None
            continue
        measured += 1
        standardised = (night.value - baseline.centre) / _above_zero(baseline.spread(night))
        ewma += WEIGHT * (standardised - ewma)
        high_since, low_since = number if high == 0 else high_since, number if low == 0 else low_since
        slack = SLACK_SIGMA + baseline.unsure
        high, low = max(0.0, high + standardised - slack), max(0.0, low - standardised - slack)
        since = None if high == low == 0 else high_since if high >= low else low_since
        yield ChartPoint(standardised, ewma, ewma_limit(measured, baseline.unsure), high, low, since)


def ewma_limit(nights: int, unsure: float = 0.0) -> float:
    """How far from 0 an EWMA of independent values of standard deviation 1 may be after so many of them.

    `unsure`: the standard deviation of what they are counted from.
    """
    return LIMIT_SIGMA * math.sqrt(WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * nights)) + unsure**2)


def hodges_lehmann(values: Sequence[float]) -> float:
    """The median of the means of all pairs: robust as a median, nearly as exact as a mean.

    Hodges and Lehmann, "Estimates of Location Based on Rank Tests", 1963.
    """
    return median((a + b) / 2 for a, b in combinations_with_replacement(values, 2))


def _above_zero(spread: float) -> float:
    # A value without any spread is off by nothing or by everything.
    return max(spread, 1e-12)
