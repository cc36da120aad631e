"""Plans of a venue's field: the markings that it is drawn by, and those that are painted on its ground besides.

Fields are given as documents, the members of `field` of a venue: so a program that has one as JSON needs no models.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from fields.shapes import WHITE, Shape
from fields.template import Template, load

TEMPLATE_MEASURES = {"length_m": "length", "width_m": "width", "line_width_m": "line"}
"""Names of measures of a field, and of the same in a template."""


def plan_of(template: str | Mapping[str, Any], uneven_m: float | None) -> Template:
    """Return markings and named points, and how uneven their ground is, by a template's name or a layout."""
    if isinstance(template, str):
        plan = load(template)
    else:
        markings = [marking_entry(marking) for marking in template["markings"]]
        plan = Template(marking=markings, points=template["points"])
    return plan if uneven_m is None else replace(plan, uneven=uneven_m)


def markings_of(template: str | Mapping[str, Any], size: Mapping[str, float]) -> tuple[Shape, ...]:
    """Return all that is painted by a template's name or a layout, for the measures of a field."""
    if isinstance(template, str):
        return _markings_of_template(template, tuple(sorted(size.items())))
    return tuple(plan_of(template, None).markings(size))


@lru_cache(maxsize=256)
def _markings_of_template(name: str, size: tuple[tuple[str, float], ...]) -> tuple[Shape, ...]:
    """Return the markings of a template, cached: drawing one takes a thousand times as long as looking it up."""
    return tuple(load(name).markings(dict(size)))


def marking_entry(marking: Mapping[str, Any]) -> dict[str, Any]:
    """Return a marking as `fields.template` reads it."""
    entry: dict[str, Any] = {"name": marking["name"], "colour": marking.get("colour", WHITE)}
    if marking.get("width_m") is not None:
        entry["width"] = marking["width_m"]
    if circle := marking.get("circle"):
        return entry | {"circle": {"centre": circle["centre"], "radius": circle["radius_m"]}}
    if spot := marking.get("spot"):
        return entry | {"spot": {"centre": spot["centre"], "diameter": spot["diameter_m"]}}
    return entry | ({"arc": arc} if (arc := marking.get("arc")) else {"line": marking["line"]})


def size_of(field: Mapping[str, Any]) -> dict[str, float]:
    """Return the measures that a plan is drawn by, of those that a field has."""
    given = {measure: field[name] for name, measure in TEMPLATE_MEASURES.items()}
    return {**{name: measure for name, measure in given.items() if measure is not None}, **field["measures_m"]}


def shapes_of_other(field: Mapping[str, Any]) -> list[Shape]:
    """Return what is painted of another sport's field, on the venue's field."""
    x, y = field["centre"]
    turn = math.radians(field["turned_deg"])
    return [shape.turned(turn).shifted((x, y)) for shape in load(field["template"]).markings(size_of(field))]


def other_shapes(others: Sequence[Mapping[str, Any]], size: Mapping[str, float]) -> list[Shape]:
    """Return what else is painted on the ground: fields of other sports, and markings one by one.

    `size`: what the plan of the venue's own field is drawn by.
    """
    own = [marking_entry(one) for one in others if "template" not in one]
    fields = [one for one in others if "template" in one]
    return [*Template(marking=own).markings(size), *(shape for field in fields for shape in shapes_of_other(field))]
