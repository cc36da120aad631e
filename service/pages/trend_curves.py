"""The trend of a camera as two SVG charts: how far it has moved at the far touchline, and by its focal length."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import hypot

from service.schemas.trend import Chart, Trend, TrendPoint, TrendState

WIDTH, HEIGHT, LEFT, RIGHT, ABOVE, BELOW = 520.0, 190.0, 46.0, 10.0, 10.0, 28.0
LEAST_TOP_CM, LEAST_TOP_PERCENT = 2.0, 0.05
"""What the scale reaches at least, so that harmless noise looks harmless."""
MOST_LEVELS, MOST_DATES = 5, 4
NIGHTS_WITH_DOTS = 130
"""Of more nights, those alone have a dot that a chart has told, and a smaller one."""
RADII: dict[TrendState, float] = {"quiet": 2.2, "drifting": 3.2, "alarm": 3.8}
LEAST_NIGHTS = 2
"""Of one night there is nothing to draw: its figures are in words."""
SMALL = 0.5


@dataclass(frozen=True)
class Tick:
    """A mark of an axis: where, what it says, and to which side of it that is written."""

    at: float
    label: str
    anchor: str = "middle"
    is_zero: bool = False


@dataclass(frozen=True)
class TrendDot:
    """A night in the box, and what to say of it."""

    x: float
    y: float
    radius: float
    state: TrendState
    words: str


@dataclass(frozen=True)
class TrendCurve:
    """A chart in a box of `width` x `height`, whose axes lie at `left`, `right` and `bottom`.

    `band`: one sigma around the values, and `average`: the EWMA, as paths; `words`: what the chart shows.
    """

    title: str
    words: str
    levels: list[Tick]
    dates: list[Tick]
    band: str
    average: str
    dots: list[TrendDot]
    width: float = WIDTH
    height: float = HEIGHT
    left: float = LEFT
    right: float = WIDTH - RIGHT
    bottom: float = HEIGHT - BELOW


@dataclass(frozen=True)
class _Value:
    """What is drawn of a night: its value, one sigma, its moving average, and how the charts of this value stand."""

    at: datetime
    value: float
    sigma: float
    average: float
    state: TrendState


def trend_curves(trend: Trend) -> list[TrendCurve]:
    """The charts of a camera that has nights enough; the second one where its focal length was ever asked for."""
    if len(trend.points) < LEAST_NIGHTS:
        return []
    moved = [_moved(point, trend.alarm_m) for point in trend.points]
    lens = [value for point in trend.points if (value := _lens(point, trend.alarm_m)) is not None]
    curves = [_curve(trend.camera, "Moved at the far touchline", moved, "cm", LEAST_TOP_CM)]
    if lens:
        curves.append(_curve(trend.camera, "Focal length", lens, "%", LEAST_TOP_PERCENT))
    return curves


def _moved(point: TrendPoint, alarm_m: float) -> _Value:
    charts = {chart.quantity: chart for chart in point.charts}
    across, away = charts["across"], charts["away"]
    average = hypot(_average(point.across_m, across), _average(point.away_m, away))
    state = _state(across.beyond or away.beyond, hypot(across.mean_m, away.mean_m), alarm_m)
    return _Value(point.at, 100 * point.displacement_m, 100 * point.sigma_m, 100 * average, state)


def _lens(point: TrendPoint, alarm_m: float) -> _Value | None:
    chart = next((chart for chart in point.charts if chart.quantity == "focal-length"), None)
    if chart is None or point.focal_length is None or point.sigma_focal_length is None:
        return None
    average = _average(point.focal_length, chart)
    state = _state(chart.beyond, abs(chart.mean_m), alarm_m)
    return _Value(point.at, 100 * point.focal_length, 100 * point.sigma_focal_length, 100 * average, state)


def _state(beyond: bool, moved_m: float, alarm_m: float) -> TrendState:
    """How a night stands by what one chart shows, whatever the other one does."""
    return "quiet" if not beyond else "alarm" if moved_m >= alarm_m else "drifting"


def _average(value: float, chart: Chart) -> float:
    """The moving average where the value is counted from, and not beside what is usual."""
    return value - chart.value + chart.mean


def _curve(camera: str, title: str, values: Sequence[_Value], unit: str, least_top: float) -> TrendCurve:
    first, last = values[0].at, values[-1].at
    low = min(min(value.value - value.sigma, value.average) for value in values)
    high = max(max(value.value + value.sigma, value.average) for value in values)
    # A distance is never below zero, a focal length may be shorter.
    low, high = (0.0, max(high, least_top)) if unit == "cm" else (min(low, -least_top), max(high, least_top))
    step = _round_step((high - low) / MOST_LEVELS)
    low, high = step * math.floor(low / step + 1e-9), step * math.ceil(high / step - 1e-9)

    def across(at: datetime) -> float:
        share = (at - first) / (last - first) if last > first else 0.5
        return round(LEFT + 6 + share * (WIDTH - LEFT - RIGHT - 12), 1)

    def up(value: float) -> float:
        share = (min(max(value, low), high) - low) / (high - low)
        return round(HEIGHT - BELOW - share * (HEIGHT - ABOVE - BELOW), 1)

    return TrendCurve(
        title=f"{title}, {unit}",
        words=f"Camera {camera}. {title}, from {_date(first)} to {_date(last)}: last {_figure(values[-1], unit)}",
        levels=_levels(low, high, step, up),
        dates=_dates(first, last, across),
        band=_band(values, across, up),
        average=_path([(across(value.at), up(value.average)) for value in values]),
        dots=_dots(values, unit, across, up),
    )


def _band(values: Sequence[_Value], across: Callable[[datetime], float], up: Callable[[float], float]) -> str:
    above = [(across(value.at), up(value.value + value.sigma)) for value in values]
    below = [(across(value.at), up(value.value - value.sigma)) for value in reversed(values)]
    return f"{_path([*above, *below])}Z"


def _dots(
    values: Sequence[_Value], unit: str, across: Callable[[datetime], float], up: Callable[[float], float]
) -> list[TrendDot]:
    many = len(values) > NIGHTS_WITH_DOTS
    shown = [value for value in values if not many or value.state != "quiet"]
    size = SMALL if many else 1.0
    return [
        TrendDot(
            across(one.at), up(one.value), size * RADII[one.state], one.state, f"{_date(one.at)}: {_figure(one, unit)}"
        )
        for one in shown
    ]


def _levels(low: float, high: float, step: float, up: Callable[[float], float]) -> list[Tick]:
    places = max(0, -math.floor(math.log10(step) + 1e-9))
    values = [low + step * number for number in range(round((high - low) / step) + 1)]
    return [Tick(up(v), f"{v + 0.0:.{places}f}", is_zero=abs(v) < step / 2) for v in values]


def _dates(first: datetime, last: datetime, across: Callable[[datetime], float]) -> list[Tick]:
    """Days evenly between the first and the last, with a year where it is another than before."""
    days = (last.date() - first.date()).days
    count = min(MOST_DATES, days + 1)
    moments = [first + (last - first) * (number / max(count - 1, 1)) for number in range(count)]
    ticks, year = [], first.year if first.year == last.year else None
    for number, moment in enumerate(moments):
        anchor = "middle" if count == 1 else "start" if number == 0 else "end" if number == count - 1 else "middle"
        label = f"{moment.day} {moment:%b}" + (f" {moment.year}" if moment.year != year else "")
        ticks.append(Tick(across(moment), label, anchor))
        year = moment.year
    return ticks


def _round_step(least: float) -> float:
    """1, 2 or 5 times a power of ten, `least` or more."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


def _path(places: Sequence[tuple[float, float]]) -> str:
    return "M" + "L".join(f"{x} {y}" for x, y in places)


def _figure(value: _Value, unit: str) -> str:
    places = 1 if unit == "cm" else 3
    return f"{value.value:.{places}f} ± {value.sigma:.{places}f} {unit}"


def _date(at: datetime) -> str:
    return f"{at.day} {at:%B %Y}"
