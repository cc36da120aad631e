"""Numbers of a field as markings, so that whatever paints markings paints them."""

from dataclasses import replace
from itertools import pairwise

from worker.calibration.geometry.field import Field


def with_numbers(pitch: Field, feet_m: float) -> Field:
    """Return the field with the strokes of its numbers among its markings, their feet so far from the touchlines."""
    numbers = pitch.template.numbers
    if numbers is None:
        return pitch
    strokes = [
        {
            "name": f"stroke of {text}",
            "line": [[place + side * x, side * (feet_m + y - pitch.width / 2)] for x, y in ends],
            "width": numbers.stroke,
        }
        for text, place in pitch.number_places()
        for side in (1, -1)
        for digit in numbers.strokes(text)
        for ends in pairwise(digit)
    ]
    return replace(pitch, template=replace(pitch.template, marking=[*pitch.template.marking, *strokes]))
