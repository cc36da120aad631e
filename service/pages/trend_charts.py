"""Data of the trend charts of a camera: its movement at the far touchline and its focal length, night by night."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import hypot
from typing import Any

from service.schemas.trend import Chart, Trend, TrendPoint, TrendState
from service.store.trend_charts import date_text, state_of

LEAST_TOP_CM, LEAST_TOP_PERCENT = 2.0, 0.05
"""Least ends of the scales: harmless noise looks harmless."""
LEAST_NIGHTS = 2
"""A single night is only told in words."""


@dataclass(frozen=True)
class TrendChart:
    """A chart: its title, a summary in words, and the data that `trends.js` draws.

    `data`: `unit` and decimal `places`; `scale`, the least range of the vertical axis; for each night its time `at`
    (Unix seconds), the `value` with one `sigma`, the moving `average`, and the `state` by the control charts.
    """

    title: str
    words: str
    data: Mapping[str, Any]


@dataclass(frozen=True)
class _Night:
    at: datetime
    value: float
    sigma: float
    average: float
    state: TrendState


def trend_charts(trend: Trend) -> list[TrendChart]:
    """Return the charts of a camera with enough nights: its movement, and its focal length if that was ever fitted."""
    if len(trend.points) < LEAST_NIGHTS:
        return []
    moved = [_moved(point, trend.alarm_m) for point in trend.points]
    lens = [night for point in trend.points if (night := _lens(point, trend.alarm_m)) is not None]
    charts = [_chart(trend.camera, "Moved at the far touchline", moved, "cm", (0.0, LEAST_TOP_CM))]
    if lens:
        scale = (-LEAST_TOP_PERCENT, LEAST_TOP_PERCENT)
        charts.append(_chart(trend.camera, "Focal length", lens, "%", scale))
    return charts


def _moved(point: TrendPoint, alarm_m: float) -> _Night:
    charts = {chart.quantity: chart for chart in point.charts}
    across, away = charts["across"], charts["away"]
    average = hypot(_average(point.across_m, across), _average(point.away_m, away))
    state = state_of(beyond=across.beyond or away.beyond, moved_m=hypot(across.mean_m, away.mean_m), alarm_m=alarm_m)
    return _Night(point.at, 100 * point.displacement_m, 100 * point.sigma_m, 100 * average, state)


def _lens(point: TrendPoint, alarm_m: float) -> _Night | None:
    chart = next((chart for chart in point.charts if chart.quantity == "focal-length"), None)
    if chart is None or point.focal_length is None or point.sigma_focal_length is None:
        return None
    average = _average(point.focal_length, chart)
    state = state_of(beyond=chart.beyond, moved_m=abs(chart.mean_m), alarm_m=alarm_m)
    return _Night(point.at, 100 * point.focal_length, 100 * point.sigma_focal_length, 100 * average, state)


def _average(value: float, chart: Chart) -> float:
    """Return the moving average relative to the anchor, as the value is, and not to the baseline."""
    return value - chart.value + chart.mean


def _chart(camera: str, title: str, nights: Sequence[_Night], unit: str, scale: tuple[float, float]) -> TrendChart:
    first, last = nights[0], nights[-1]
    places = 1 if unit == "cm" else 3
    period = f"from {date_text(first.at)} to {date_text(last.at)}"
    return TrendChart(
        title=f"{title}, {unit}",
        words=f"Camera {camera}. {title}, {period}: last {last.value:.{places}f} ± {last.sigma:.{places}f} {unit}",
        data={
            "unit": unit,
            "places": places,
            "scale": scale,
            "at": [round(night.at.timestamp()) for night in nights],
            "value": [round(night.value, 4) for night in nights],
            "sigma": [round(night.sigma, 4) for night in nights],
            "average": [round(night.average, 4) for night in nights],
            "state": [night.state for night in nights],
        },
    )
