"""Control charts of a camera's trend: a point a night, a state and a sentence, from its rows.

Nights are days of UTC. Where a schedule calibrates many times a day, the mean of the day counts: the sun warms a mast
and lets it cool again, which is no trend.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from itertools import groupby
from math import hypot
from statistics import fmean, median
from typing import Any

from service.control_charts import DECISION_SIGMA, LIMIT_SIGMA, NIGHTS_OF_BASELINE, Baseline, ChartPoint, Night, charted
from service.schemas.trend import Chart, Quantity, Trend, TrendPoint, TrendState
from service.store.unreadable import read_or

# The shift at the far touchline that is an alarm, where the venue says nothing else.
ALARM_M = 0.05
# With fewer nights no chart can exceed its limits, however far a camera moves: the spread of three includes the move.
NIGHTS_TO_JUDGE = 4
Rows = Sequence[Any]
# The column of each quantity, and that of its repeatability.
QUANTITIES: Mapping[Quantity, tuple[str, str]] = {
    "across": ("across_m", "repeatability_across_m"),
    "away": ("away_m", "repeatability_away_m"),
    "focal-length": ("focal_length", "sigma_focal_length"),
}


@dataclass(frozen=True)
class Series:
    """A quantity night by night: its `nights`, None where it was not measured, what is usual, and its charts."""

    quantity: Quantity
    nights: list[Night | None]
    baseline: Baseline
    points: list[ChartPoint | None]

    @property
    def is_settled(self) -> bool:
        """True once there are nights enough to say what is usual, for good."""
        return sum(night is not None for night in self.nights) >= NIGHTS_OF_BASELINE

    def mean(self, number: int) -> float:
        """Return the moving average beside the baseline after a night, in the quantity's own unit."""
        last = next((n for n in range(number, -1, -1) if self.points[n] is not None), None)
        if last is None:
            return 0.0
        night, point = self.nights[last], self.points[last]
        assert night is not None
        assert point is not None
        return point.ewma * self.baseline.spread(night)

    def last(self, number: int) -> ChartPoint | None:
        """Return the newest point of the charts up to a night, or None."""
        return next((point for point in reversed(self.points[: number + 1]) if point is not None), None)


@dataclass(frozen=True)
class CameraCharts:
    """The charts of a camera since its anchor, one place in all lists a night."""

    nights: Sequence[Rows]
    series: Sequence[Series]

    @classmethod
    def of(cls, rows: Rows, settled: Mapping[str, Baseline]) -> "CameraCharts":
        """Chart the rows since an anchor, oldest first; `settled`: the baselines that are known for good."""
        nights = [list(several) for _, several in groupby(rows, lambda row: row.at.date())]
        return cls(nights, [_series(quantity, nights, settled.get(quantity)) for quantity in QUANTITIES])

    @property
    def settled(self) -> dict[str, Baseline]:
        """Baselines that no later night changes, by quantity."""
        return {series.quantity: series.baseline for series in self.series if series.is_settled}

    def beyond(self, number: int) -> list[Series]:
        """Return the quantities whose mean has moved, by either chart, after a night."""
        return [series for series in self.series if (last := series.last(number)) is not None and last.is_beyond]

    def moved_m(self, number: int) -> float:
        """Return the movement at the far touchline, m: of quantities beyond their limits, or else of the pose."""
        beyond = {series.quantity for series in self.beyond(number)}
        across, away, focal = (series.mean(number) for series in self.series)
        of_lens_m = abs(focal) * self.nights[number][-1].focal_length_m
        of_pose_m = hypot(across, away)
        by_lens_alone = beyond == {"focal-length"}
        return max(0.0 if by_lens_alone else of_pose_m, of_lens_m if "focal-length" in beyond else 0.0)

    def cusum(self, number: int) -> float:
        """Return the largest cumulative sum of all quantities after a night."""
        return max((max(point.high, point.low) for point in _last_points(self.series, number)), default=0.0)

    def state(self, number: int, alarm_m: float) -> TrendState:
        """Return the state of the camera after a night."""
        beyond = bool(self.beyond(number))
        if beyond or number + 1 >= NIGHTS_TO_JUDGE:
            return state_of(beyond=beyond, moved_m=self.moved_m(number), alarm_m=alarm_m)
        jump_m, sigma_m = self.jump(number)
        return "jumped" if jump_m >= alarm_m and jump_m > LIMIT_SIGMA * sigma_m else "too-few-nights"

    def jump(self, number: int) -> tuple[float, float]:
        """Return how far the last pose of a night is from the anchor at the far touchline, and its sigma, m."""
        last = self.nights[number][-1:]
        across, away = last[0].across_m, last[0].away_m
        return hypot(across, away), _sigma_m(last, across, away)

    def words(self, camera: str) -> str:
        """Return a sentence about the camera after the last night."""
        number = len(self.nights) - 1
        beyond = self.beyond(number)
        if not beyond and number + 1 < NIGHTS_TO_JUDGE:
            few = f"too few nights to judge by ({number + 1} of {NIGHTS_TO_JUDGE})"
            jump_m, sigma_m = self.jump(number)
            if jump_m <= LIMIT_SIGMA * sigma_m:
                return f"Camera {camera}: {few}."
            return (
                f"Camera {camera} stands {_cm(jump_m)} ± {_cm(sigma_m)} from its anchor at the far touchline, more "
                f"than {LIMIT_SIGMA:.0f} sigma; {few} whether it is a trend: if nobody moved it, look at its mount."
            )
        if not beyond:
            first = self.nights[0][0].at
            return (
                f"Camera {camera} has not moved beyond what its own spread explains since {date_text(first)} "
                f"({number + 1} night{'s' if number else ''})."
            )
        of_pose = [series for series in beyond if series.quantity != "focal-length"]
        of_lens = [series for series in beyond if series.quantity == "focal-length"]
        findings = []
        if of_pose:
            across, away = self.series[0].mean(number), self.series[1].mean(number)
            findings.append(f"moved {_cm(hypot(across, away))} at the far touchline {self._since(of_pose)}")
        for series in of_lens:
            longer = series.mean(number)
            moves_m = abs(longer) * self.nights[number][-1].focal_length_m
            by = f"{abs(longer):.2%} {'longer' if longer > 0 else 'shorter'}"
            findings.append(f"has a focal length {by} {self._since([series])}, {_cm(moves_m)} at the far touchline")
        charts = self._which_charts(beyond)
        return f"Camera {camera} {' and '.join(findings)}: beyond what its own spread explains ({charts})."

    def trend(self, venue: str, camera: str, anchor: int, alarm_m: float, since: datetime | None) -> Trend:
        """Return the whole trend; `since`: without the nights before that."""
        number = len(self.nights) - 1
        shown = [n for n, rows in enumerate(self.nights) if since is None or rows[-1].at >= since]
        return Trend(
            venue=venue,
            camera=camera,
            anchor=anchor,
            since=self.nights[0][0].at,
            state=self.state(number, alarm_m),
            words=self.words(camera),
            alarm_m=alarm_m,
            moved_m=self.moved_m(number),
            baseline_nights=min(number + 1, NIGHTS_OF_BASELINE),
            points=[self._point(n, alarm_m) for n in shown],
        )

    def _since(self, several: Sequence[Series]) -> str:
        """Return in words when the first of several quantities began to move."""
        begun = [point.since for point in _last_points(several, len(self.nights) - 1) if point.since is not None]
        return f"since {date_text(self.nights[min(begun, default=0)][0].at)}"

    def _which_charts(self, beyond: Sequence[Series]) -> str:
        last = _last_points(beyond, len(self.nights) - 1)
        names = (("EWMA", any(p.is_beyond_ewma for p in last)), ("CUSUM", any(p.is_beyond_cusum for p in last)))
        return " and ".join(name for name, rings in names if rings)

    def _point(self, number: int, alarm_m: float) -> TrendPoint:
        rows = self.nights[number]
        across, away = _mean(rows, "across_m"), _mean(rows, "away_m")
        displacement = hypot(across or 0.0, away or 0.0)
        return TrendPoint(
            at=rows[-1].at,
            job=rows[-1].job,
            jobs=len(rows),
            displacement_m=displacement,
            sigma_m=_sigma_m(rows, across or 0.0, away or 0.0),
            across_m=across or 0.0,
            away_m=away or 0.0,
            rotation_deg=_mean(rows, "rotation_deg") or 0.0,
            sigma_rotation_deg=_median(rows, "sigma_rotation_deg"),
            position_m=_mean(rows, "position_m") or 0.0,
            sigma_position_m=_median(rows, "sigma_position_m"),
            focal_length=_mean(rows, "focal_length"),
            sigma_focal_length=_median(rows, "sigma_focal_length"),
            charts=[
                chart for one in self.series if (chart := _chart(one, number, rows[-1].focal_length_m)) is not None
            ],
            state=self.state(number, alarm_m),
        )


def chart_columns(camera: str, since: Rows, anchor: Any) -> dict[str, Any]:
    """Return the chart columns of the anchor of a camera, by the rows since it."""
    if not since:
        return no_chart_columns(camera)
    charts = CameraCharts.of(since, baselines_of(anchor))
    last = len(charts.nights) - 1
    return {
        "baselines": {quantity: asdict(baseline) for quantity, baseline in charts.settled.items()},
        "beyond": bool(charts.beyond(last)),
        "moved_m": charts.moved_m(last),
        "cusum": charts.cusum(last),
        "words": charts.words(camera),
    }


def no_chart_columns(camera: str) -> dict[str, Any]:
    """Return the columns of an anchor without an accepted pose."""
    words = f"Camera {camera} has had no pose accepted since it was put."
    return dict.fromkeys(("at", "posed", "moved_m", "cusum")) | {"baselines": {}, "beyond": False, "words": words}


def baselines_of(anchor: Any) -> Mapping[str, Baseline]:
    """Return the settled baselines of an anchor by quantity; {} if they cannot be read, and they begin anew."""
    return read_or({}, "trend", anchor.venue, lambda: {key: Baseline(**one) for key, one in anchor.baselines.items()})


def _last_points(several: Sequence[Series], number: int) -> list[ChartPoint]:
    return [point for series in several if (point := series.last(number)) is not None]


def state_of(*, beyond: bool, moved_m: float, alarm_m: float) -> TrendState:
    """Return `drifting` once a mean has moved, `alarm` if by `alarm_m` at the far touchline, else `quiet`."""
    if not beyond:
        return "quiet"
    return "alarm" if moved_m >= alarm_m else "drifting"


def _series(quantity: Quantity, nights: Sequence[Rows], settled: Baseline | None) -> Series:
    value_column, sigma_column = QUANTITIES[quantity]
    values = [_night(rows, value_column, sigma_column) for rows in nights]
    measured = [night for night in values if night is not None]
    baseline = settled or (Baseline.of(measured) if measured else Baseline(0.0, 0.0))
    return Series(quantity, values, baseline, list(charted(values, baseline)))


def _night(rows: Rows, value_column: str, sigma_column: str) -> Night | None:
    value, sigma = _mean(rows, value_column), _median(rows, sigma_column)
    return None if value is None or sigma is None else Night(value, sigma)


def _chart(series: Series, number: int, focal_length_m: float) -> Chart | None:
    night, point = series.nights[number], series.points[number]
    if night is None or point is None:
        return None
    spread = series.baseline.spread(night)
    mean = point.ewma * spread
    return Chart(
        quantity=series.quantity,
        value=night.value - series.baseline.centre,
        mean=mean,
        mean_m=mean * focal_length_m if series.quantity == "focal-length" else mean,
        spread=spread,
        ewma=point.ewma,
        ewma_limit=point.limit,
        cusum_high=point.high,
        cusum_low=point.low,
        cusum_limit=DECISION_SIGMA,
        beyond=point.is_beyond,
    )


def _sigma_m(rows: Rows, across_m: float, away_m: float) -> float:
    """Return the standard deviation of a displacement along its own direction, m; of a zero one, the larger of both."""
    across, away = _median(rows, "sigma_across_m") or 0.0, _median(rows, "sigma_away_m") or 0.0
    length = hypot(across_m, away_m)
    if length == 0:
        return max(across, away)
    return hypot(across * across_m / length, away * away_m / length)


def _mean(rows: Rows, column: str) -> float | None:
    return _of_known(fmean, rows, column)


def _median(rows: Rows, column: str) -> float | None:
    return _of_known(median, rows, column)


def _of_known(middle: Callable[[Sequence[float]], float], rows: Rows, column: str) -> float | None:
    known = [value for row in rows if (value := getattr(row, column)) is not None]
    return middle(known) if known else None


def date_text(at: datetime) -> str:
    """Return a date in words."""
    return f"{at.day} {at:%B %Y}"


def _cm(metres: float) -> str:
    return f"{100 * metres:.1f} cm"
