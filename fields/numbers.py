"""Numbers painted beside lines that look alike, and the strokes of their digits, in metres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fields.shapes import Point

STROKES: Mapping[str, Sequence[Point]] = {
    "0": ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0)),
    "1": ((0.5, 0), (0.5, 1)),
    "2": ((0, 1), (1, 1), (1, 0.5), (0, 0.5), (0, 0), (1, 0)),
    "3": ((0, 1), (1, 1), (1, 0.5), (0.3, 0.5), (1, 0.5), (1, 0), (0, 0)),
    "4": ((0.75, 0), (0.75, 1), (0, 0.35), (1, 0.35)),
    "5": ((1, 1), (0, 1), (0, 0.55), (1, 0.55), (1, 0), (0, 0)),
}
"""Polyline through the middle of the strokes of each digit: 0..1 from left to right and from foot to head."""


@dataclass(frozen=True)
class PaintedNumbers:
    """Numbers on both sides of a field, upright as seen from the nearer touchline, their middles on lines across it.

    `text`: each number and the place of its line along the field at the left end, as templates write it; `height` and
    `width` of a digit, outer edge to outer edge; `stroke`: width of the paint; `apart`: the room between two digits;
    `feet`: least and largest distance of their feet from the touchline.
    """

    text: Mapping[str, str | float]
    height: float
    width: float
    stroke: float
    apart: float
    feet: tuple[float, float]

    def strokes(self, text: str) -> list[list[Point]]:
        """Return a polyline for each digit of a number: from its middle to the right, and from its feet up."""
        step, inset = self.width + self.apart, self.stroke / 2
        left = -self.half_width(text)
        return [
            [
                (
                    left + number * step + inset + x * (self.width - self.stroke),
                    inset + y * (self.height - self.stroke),
                )
                for x, y in STROKES[digit]
            ]
            for number, digit in enumerate(text)
        ]

    def half_width(self, text: str) -> float:
        """Return how far a number reaches to each side of its middle."""
        return (len(text) * (self.width + self.apart) - self.apart) / 2
