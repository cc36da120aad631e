"""SVG chart of a seam: the distance between two cameras' positions of the same paint, along the seam."""

from dataclasses import dataclass

from service.schemas.results import PairResult, SeamPlace

WIDTH, HEIGHT, LEFT, BELOW, ABOVE = 480.0, 120.0, 34.0, 18.0, 8.0
LEAST_TOP_CM = 5.0
"""Least error at the top of the chart: harmless errors look harmless."""


@dataclass(frozen=True)
class SeamDot:
    """A place of the seam in the chart: its error, one sigma around it (`low`, `high`), and its tooltip (`words`).

    `worst`: it is the worst place, by more than its uncertainty.
    """

    x: float
    y: float
    low: float
    high: float
    words: str
    worst: bool


@dataclass(frozen=True)
class SeamCurve:
    """Dots in a box of `WIDTH` x `HEIGHT`; `top_cm`: the error at the height `top`; `base`: the height of no error."""

    dots: list[SeamDot]
    path: str
    top_cm: float
    base: float
    top: float


def is_within_uncertainty(place: SeamPlace) -> bool:
    """True if the error of a place is below two sigma."""
    return place.error_cm < 2 * place.sigma_cm


def seam_curve(pair: PairResult) -> SeamCurve | None:
    """Return the chart of a pair of cameras; None if its seam has fewer than two places."""
    places = pair.seam
    if len(places) < 2:
        return None
    top_cm = max(LEAST_TOP_CM, *(place.error_cm + place.sigma_cm for place in places))
    across, up = WIDTH - LEFT - 6, HEIGHT - BELOW - ABOVE

    def height(error_cm: float) -> float:
        return round(HEIGHT - BELOW - up * min(max(error_cm, 0.0) / top_cm, 1.0), 1)

    dots = [
        SeamDot(
            round(LEFT + 4 + (across - 8) * number / (len(places) - 1), 1),
            height(place.error_cm),
            height(place.error_cm - place.sigma_cm),
            height(place.error_cm + place.sigma_cm),
            f"{place.error_cm:.1f} ± {place.sigma_cm:.1f} cm at ({round(place.at[0])}, {round(place.at[1])}) m",
            place == pair.worst and not is_within_uncertainty(place),
        )
        for number, place in enumerate(places)
    ]
    path = "M" + "L".join(f"{dot.x} {dot.y}" for dot in dots)
    return SeamCurve(dots, path, round(top_cm, 1), height(0.0), height(top_cm))
