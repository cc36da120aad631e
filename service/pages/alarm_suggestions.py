"""Suggested alarm limits for a venue, by the spread of its own calibrations."""

import math
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import groupby, pairwise
from statistics import median

from service.control_charts import LIMIT_SIGMA, NIGHTS_OF_BASELINE, Baseline, Night
from service.schemas.history import Revision
from service.schemas.trend import Trend
from service.store.statistics.past_calibrations import PastCalibration

MISSED = 2
"""Median intervals between two calibrations after which one was missed."""


def suggested_limits(
    ends: Sequence[PastCalibration], revisions: Sequence[Revision], trends: Sequence[Trend]
) -> dict[str, str]:
    """Return suggested limits by rule, for rules with enough nights for a baseline.

    A limit is three sigma above the usual value, as in control charts. `ends` and `revisions`: newest first.
    """
    ends = [end for end in ends if not end.dry_run]
    moved_px = [end.moved_px for end in ends if end.accepted and end.moved_px is not None]
    drift_px = [max(drifts) for one in revisions if (drifts := list(_drifts_px(one)))]
    spreads_m = [
        chart.spread
        for trend in trends
        if trend.baseline_nights >= NIGHTS_OF_BASELINE
        for chart in trend.points[-1].charts
        if chart.quantity != "focal-length"
    ]
    limits = {
        "moved_since_last_px": _three_sigma_above(moved_px),
        "moved_since_first_px": _three_sigma_above(drift_px),
        "rejected_in_a_row": _longest_run_plus_one(ends),
        "not_calibrated_for_h": _hours_until_missed([end.finished_at for end in ends if end.accepted]),
        "trend_m": LIMIT_SIGMA * max(spreads_m) if spreads_m else trends[0].alarm_m if trends else None,
    }
    return {rule: f"{_rounded_up(limit):g}" for rule, limit in limits.items() if limit}


def _drifts_px(revision: Revision) -> Iterator[float]:
    for camera in revision.cameras:
        if camera.drift is not None and camera.drift.pixels is not None:
            yield camera.drift.pixels


def _three_sigma_above(values: Sequence[float]) -> float | None:
    if len(values) < NIGHTS_OF_BASELINE:
        return None
    usual = Baseline.of([Night(value, 0.0) for value in values])
    return usual.centre + LIMIT_SIGMA * usual.extra


def _longest_run_plus_one(ends: Sequence[PastCalibration]) -> float | None:
    """Return one more than the longest run of rejected calibrations."""
    if len(ends) < NIGHTS_OF_BASELINE:
        return None
    runs = [len(list(run)) for is_accepted, run in groupby(ends, lambda end: bool(end.accepted)) if not is_accepted]
    return max(runs, default=1) + 1


def _hours_until_missed(moments: Sequence[datetime]) -> float | None:
    if len(moments) < NIGHTS_OF_BASELINE:
        return None
    return MISSED * median((later - earlier).total_seconds() for later, earlier in pairwise(moments)) / 3600


def _rounded_up(limit: float) -> float:
    """Round up to two significant digits: 0.83 stays, 2.412 becomes 2.5."""
    step = 10.0 ** (math.floor(math.log10(limit)) - 1)
    return math.ceil(limit / step - 1e-6) * step
