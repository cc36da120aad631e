"""Control charts that detect a shift of a nightly series.

Two charts of the standardised values, both two-sided, as in Montgomery, *Introduction to Statistical Quality Control*:
the exponentially weighted moving average (EWMA), which shows where the mean is now, and the tabular cumulative sum
(CUSUM), which adds up small shifts and dates their beginning. Plain numbers in, plain numbers out; the unit is the
caller's.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from statistics import median

WEIGHT, LIMIT_SIGMA = 0.2, 3.0
"""Parameters of the EWMA: λ, and the width L of its limits."""
SLACK_SIGMA, DECISION_SIGMA = 0.5, 5.0
"""Parameters of the CUSUM: k, half the shift to detect, and h, its limit."""
NIGHTS_OF_BASELINE = 20
"""First nights, which make the baseline."""
MAD_TO_SIGMA = 1.4826
"""Ratio of standard deviation to median absolute deviation in a normal distribution."""


@dataclass(frozen=True)
class Night:
    """A value and its stated repeatability: one standard deviation, in the value's unit."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Baseline:
    """Baseline of a series: the centre of its values, and the `extra` spread that they have beyond the stated one.

    `extra` is the effect of wind and heat, which no single night shows. `unsure`: one standard deviation of the centre,
    as a part of a night's: without it, false alarms would be three times as frequent.
    """

    centre: float
    extra: float
    unsure: float = 0.0

    @classmethod
    def of(cls, nights: Sequence[Night]) -> "Baseline":
        """Estimate the baseline from the first nights, robust against outliers."""
        first = nights[:NIGHTS_OF_BASELINE]
        values = [night.value for night in first]
        centre = hodges_lehmann(values)
        spread = MAD_TO_SIGMA * median(abs(value - centre) for value in values)
        stated = median(night.sigma for night in first)
        return cls(centre, math.sqrt(max(spread**2 - stated**2, 0.0)), 1 / math.sqrt(len(first)))

    def spread(self, night: Night) -> float:
        """Return one standard deviation of a night's value around the centre, at least the stated one."""
        return math.hypot(night.sigma, self.extra)


@dataclass(frozen=True)
class ChartPoint:
    """State of both charts after a night, in standard deviations from the centre.

    `limit`: limit of the EWMA, which widens from night to night; `high` and `low`: the CUSUM's upward and downward
    sums, 0 or more; `since`: index of the night since which the larger sum has been above 0, the estimated beginning of
    the shift; None while both are 0.
    """

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
        """True while either chart is beyond its limit."""
        return self.is_beyond_ewma or self.is_beyond_cusum


def charted(nights: Iterable[Night | None], baseline: Baseline) -> Iterator[ChartPoint | None]:
    """Yield the state of both charts after each night; None for a night without a value."""
    ewma = high = low = 0.0
    high_since = low_since = measured = 0
    for number, night in enumerate(nights):
        if night is None:
            yield None
            continue
        measured += 1
        # A series without any spread would divide by zero.
        standardised = (night.value - baseline.centre) / max(baseline.spread(night), 1e-12)
        ewma += WEIGHT * (standardised - ewma)
        high_since, low_since = number if high == 0 else high_since, number if low == 0 else low_since
        slack = SLACK_SIGMA + baseline.unsure
        high, low = max(0.0, high + standardised - slack), max(0.0, low - standardised - slack)
        since = None if high == low == 0 else high_since if high >= low else low_since
        yield ChartPoint(ewma, ewma_limit(measured, baseline.unsure), high, low, since)


def ewma_limit(nights: int, unsure: float = 0.0) -> float:
    """Return the limit of an EWMA of independent values of standard deviation 1 after so many nights.

    `unsure`: standard deviation of the centre.
    """
    return LIMIT_SIGMA * math.sqrt(WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * nights)) + unsure**2)


def hodges_lehmann(values: Sequence[float]) -> float:
    """Return the median of the means of all pairs: robust as a median, nearly as exact as a mean.

    Hodges and Lehmann, "Estimates of Location Based on Rank Tests", 1963.
    """
    return median((a + b) / 2 for a, b in combinations_with_replacement(values, 2))
