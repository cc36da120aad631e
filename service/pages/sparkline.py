"""Small curves as SVG paths, such as the last stitch errors of a venue."""

from collections.abc import Sequence
from dataclasses import dataclass

WIDTH, HEIGHT, MARGIN = 120.0, 32.0, 3.0
# Least height of the limit, as a part of the box: harmless noise looks harmless.
LIMIT_AT_LEAST = 0.5


@dataclass(frozen=True)
class Sparkline:
    """A curve (`path`) and its last `dot` in a box of `WIDTH` x `HEIGHT`; `limit`: height of the limit, if any."""

    path: str
    dot: tuple[float, float]
    limit: float | None


def sparkline(values: Sequence[float | None], limit: float | None) -> Sparkline | None:
    """Return the curve of values, oldest first; None if fewer than two are known. Values are clipped at the top."""
    known = [(number, value) for number, value in enumerate(values) if value is not None]
    if len(known) < 2:
        return None
    top = max(value for _, value in known)
    if limit is not None:
        top = min(max(top, limit), limit / LIMIT_AT_LEAST)
    top = top or 1.0
    across, up = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    first, last = known[0][0], known[-1][0]

    def height(value: float) -> float:
        return round(HEIGHT - MARGIN - up * min(value / top, 1.0), 2)

    places = [(round(MARGIN + across * (n - first) / (last - first), 2), height(value)) for n, value in known]
    path = "M" + "L".join(f"{x} {y}" for x, y in places)
    return Sparkline(path, places[-1], None if limit is None else height(limit))
