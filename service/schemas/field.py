"""Model of the pitch: a sport's template or custom markings, its dimensions and its ridge."""

import math
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from fields.plans import TEMPLATE_MEASURES, markings_of, plan_of, size_of
from fields.shapes import COLOUR_PATTERN, WHITE, Shape
from fields.sports import LONGEST, nearest_template_name, template_name
from fields.template import NAMES, Extent, Template, load
from service.schemas.base import Name, Number, Schema, is_tolerant
from service.schemas.geometry import Row
from service.schemas.names import FieldNumber

PitchPoint = Annotated[list[Annotated[Number, Field(ge=-200, le=200)]], Field(min_length=2, max_length=2)]
Length = Annotated[Number, Field(gt=0, le=400)]
PaintWidth = Annotated[Number, Field(ge=0.01, le=1)]
Colour = Annotated[str, StringConstraints(pattern=COLOUR_PATTERN)]
# A field that is known less well than this may be another one.
MOST_SIGMA_M = 10.0
# Markings may lie this far outside the field.
MARGIN_M = 2.0
FOOTBALL = "football"
# Units that a length may have been given in by mistake, in metres.
OTHER_UNITS = {"centimetres": 0.01, "feet": 0.3048, "yards": 0.9144}
MAX_OTHER_FIELDS = 16


class ArcIn(Schema):
    """An arc along the paint's middle, counter-clockwise seen from above."""

    centre: PitchPoint = Field(description="Centre, [x, y] in metres.")
    start: PitchPoint = Field(description="Where the arc begins, [x, y] in metres.")
    end: PitchPoint = Field(description="Where it ends, [x, y] in metres.")

    @model_validator(mode="after")
    def _round(self) -> Self:
        first, last = math.dist(self.centre, self.start), math.dist(self.centre, self.end)
        if first == 0 or abs(first - last) > 0.01:
            raise ValueError(f"start is {first:.2f} m from the centre, end {last:.2f} m: one radius is needed")
        return self


class CircleIn(Schema):
    """A full circle."""

    centre: PitchPoint = Field(description="Centre, [x, y] in metres.")
    radius_m: Length = Field(description="Radius to the middle of the paint, m.")


class SpotIn(Schema):
    """A disc of paint."""

    centre: PitchPoint = Field(description="Centre, [x, y] in metres.")
    diameter_m: PaintWidth = Field(description="Diameter, m.")


class MarkingIn(Schema):
    """One painted marking: exactly one of `line`, `arc`, `circle` and `spot`."""

    name: Annotated[Name, Field(min_length=1)] = Field(description="Name of the marking.")
    line: Annotated[list[PitchPoint], Field(min_length=2, max_length=200)] | None = Field(
        None, description="Points of a line of straight pieces, [x, y] in metres."
    )
    arc: ArcIn | None = None
    circle: CircleIn | None = None
    spot: SpotIn | None = None
    width_m: PaintWidth | None = Field(None, description="Width of the paint; absent: the field's `line_width_m`.")
    colour: Colour = Field(
        WHITE,
        description="Colour of the paint: white, yellow, black, blue, red, green, orange or `#rrggbb`.",
        examples=["yellow", "#0a5fa8"],
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if sum(shape is not None for shape in (self.line, self.arc, self.circle, self.spot)) != 1:
            raise ValueError(f"marking {self.name} must be exactly one of line, arc, circle and spot")
        if self.line and any(a == b for a, b in pairwise(self.line)):
            raise ValueError(f"marking {self.name} has the same point twice in a row")
        return self


class Layout(Schema):
    """Custom markings instead of a template, and names for points that can be clicked."""

    markings: Annotated[list[MarkingIn], Field(min_length=1, max_length=500)] = Field(description="Painted markings.")
    points: Annotated[dict[Annotated[Name, Field(min_length=1)], PitchPoint], Field(max_length=1000)] = Field(
        {}, description="Points that can be clicked, [x, y] in metres by name."
    )


def _as_a_template(name: str, info: ValidationInfo) -> str:
    meant = template_name(name)
    if meant is not None or is_tolerant(info):
        return meant or name
    near = nearest_template_name(name)
    suggestion = f"; did you mean {near}?" if near else ""
    raise ValueError(
        f"{name[:LONGEST]} is none of the templates {', '.join(NAMES)}, nor markings of your own{suggestion}"
    )


TemplateName = Annotated[str, AfterValidator(_as_a_template), WithJsonSchema({"type": "string", "enum": list(NAMES)})]


class OtherField(Schema):
    """A field of another sport on the same ground."""

    template: TemplateName = Field(description="Name of the sport's template.")
    length_m: Length | None = Field(None, description="Length along its x axis; absent: the template's.")
    width_m: Length | None = Field(None, description="Width along its y axis; absent: the template's.")
    line_width_m: PaintWidth | None = Field(None, description="Width of its lines; absent: the template's.")
    measures_m: dict[str, Number] = Field({}, description="Other dimensions that the template lets you set, by name.")
    centre: PitchPoint = Field([0.0, 0.0], description="Position of its centre on the venue's field, m.")
    turned_deg: Annotated[Number, Field(ge=-360, le=360)] = Field(
        0.0, description="Angle from the venue's x axis to its own, counter-clockwise seen from above."
    )

    @model_validator(mode="after")
    def _of_this_template(self) -> Self:
        if self.template not in NAMES:
            return self
        extents = load(self.template).size
        for name, measure in self.size.items():
            if name not in extents:
                raise ValueError(f"{name} is not among what {self.template} leaves open: {', '.join(extents)}")
            _must_lie(measure, extents[name], f"{self.template}, {name}")
        return self

    @property
    def size(self) -> dict[str, float]:
        """Dimensions that differ from the template's, by name, m."""
        return size_of(dict(self))


def _kind_of_other(given: Any) -> str:
    whole = isinstance(given, OtherField) or (isinstance(given, dict) and "template" in given)
    return "field" if whole else "marking"


OtherMarking = Annotated[
    Annotated[OtherField, Tag("field")] | Annotated[MarkingIn, Tag("marking")], Discriminator(_kind_of_other)
]


def _usual_need_not_be_given(schema: dict[str, Any]) -> None:
    schema["required"] = [name for name in schema["required"] if name not in TEMPLATE_MEASURES]


class FieldOfPlay(Schema):
    """The pitch. `ridge`: both ends of the ridge of a crowned pitch (same y, same z); absent or null: flat."""

    model_config = ConfigDict(json_schema_extra=_usual_need_not_be_given)

    template: Annotated[
        Annotated[TemplateName, Tag("name")] | Annotated[Layout, Tag("layout")],
        Discriminator(lambda given: "name" if isinstance(given, str) else "layout"),
    ] = Field(
        FOOTBALL,
        description="Name of a sport's template, or custom markings. Other names of a sport, such as `soccer` or "
        "`ice hockey`, are stored as the template's name.",
    )
    length_m: Length = Field(description="Length along x; absent: the template's.")
    width_m: Length = Field(description="Width along y; absent: the template's.")
    line_width_m: PaintWidth = Field(description="Width of the lines; absent: the template's.")
    measures_m: dict[str, Number] = Field({}, description="Other dimensions that the template lets you set, by name.")
    ridge: Annotated[list[Row], Field(min_length=2, max_length=2)] | None = Field(
        None,
        description="Both ends of the ridge of a crowned surface, [x, y, z] in m, with one y and one z; null: flat. A "
        "goal line at which the ridge ends goes over the crown, as in most stadiums; every other one is level.",
    )
    uneven_m: Annotated[Number, Field(ge=0.001, le=0.1)] | None = Field(
        None,
        description="Unevenness of the ground: one standard deviation of its height around the plane, or around the "
        "crowned surface, m. Absent: the template's (0.015 on turf, 0.005 indoors); turf's for custom markings.",
    )
    sigma: dict[FieldNumber, Annotated[Number, Field(gt=0, le=MOST_SIGMA_M)]] = Field(
        {},
        description="Uncertainty of the field's dimensions: one standard deviation by name, m. Absent: 0.02 for the "
        "ridge, and that of a careful tape measurement for length and width (0.03 %). Where the rules leave these to "
        "each ground, it is that of their last digit: 105 is known to 0.29, 104.6 to 0.03. Poses include it.",
        examples=[{"length_m": 0.5, "width_m": 0.5}],
    )
    other_markings: Annotated[list[OtherMarking], Field(max_length=500)] = Field(
        [],
        description="Other paint on the ground: fields of other sports by template, or single markings. They are not "
        "used for calibration, and do not count as unexpected lines.",
        examples=[[{"template": "american-football", "length_m": 109.728, "width_m": 48.768}]],
    )

    @model_validator(mode="before")
    @classmethod
    def _as_usual(cls, given: Any) -> Any:
        template = given.get("template", FOOTBALL) if isinstance(given, dict) else None
        if not isinstance(template, str):
            return given
        # An unknown sport is reported by its name alone, without complaints about missing dimensions.
        size = load(template_name(template) or FOOTBALL).size
        return {name: size[measure].default for name, measure in TEMPLATE_MEASURES.items()} | given

    @field_validator(*TEMPLATE_MEASURES)
    @classmethod
    def _as_the_sport_has_it(cls, given: float, info: ValidationInfo) -> float:
        template = info.data.get("template")
        if isinstance(template, str) and template in NAMES and info.field_name:
            _must_lie(given, load(template).size[TEMPLATE_MEASURES[info.field_name]], template)
        return given

    @field_validator("measures_m")
    @classmethod
    def _are_left_open(cls, given: dict[str, float], info: ValidationInfo) -> dict[str, float]:
        template = info.data.get("template")
        if isinstance(template, str) and template not in NAMES:
            return given
        extents = load(template).size if isinstance(template, str) else {}
        others = {name: extent for name, extent in extents.items() if name not in TEMPLATE_MEASURES.values()}
        for name, measure in given.items():
            if name not in others:
                raise ValueError(f"{name} is not among what the template leaves open: {', '.join(others) or 'nothing'}")
            _must_lie(measure, others[name], f"{template}, {name}")
        return given

    @model_validator(mode="after")
    def _a_field(self) -> Self:
        if not self.is_known:
            return self
        for shape in self.markings:
            x, y = shape.reach
            if x > self.length_m / 2 + MARGIN_M or y > self.width_m / 2 + MARGIN_M:
                raise ValueError(
                    f"{shape.name} leaves the {self.length_m:g} x {self.width_m:g} m of the field, "
                    "whose centre is the origin"
                )
        return self

    @model_validator(mode="after")
    def _shared_by_few(self) -> Self:
        others = sum(isinstance(other, OtherField) for other in self.other_markings)
        if others > MAX_OTHER_FIELDS:
            raise ValueError(f"other_markings has {others} fields of other sports: at most {MAX_OTHER_FIELDS}")
        return self

    @model_validator(mode="after")
    def _a_roof(self) -> Self:
        if self.ridge is None:
            return self
        (x1, y1, z1), (x2, y2, z2) = self.ridge
        if y1 != y2 or z1 != z2:
            raise ValueError("both ends of the ridge need the same y and the same z")
        # Answers are rounded to a millimetre.
        if max(abs(x1), abs(x2)) > self.length_m / 2 + 0.001 or abs(y1) >= self.width_m / 2:
            raise ValueError(
                f"the ridge must lie inside the pitch, within {self.length_m / 2:g} m along and {self.width_m / 2:g} m "
                f"across from its middle, not at {x1:g} and {x2:g} m along, {y1:g} m across"
            )
        if not 0 <= z1 <= 3:
            raise ValueError(f"the ridge must be 0 to 3 m high, not {z1:g} m")
        return self

    def number(self, name: FieldNumber) -> float:
        """Return a dimension of the field, m; the ridge height of a flat field is 0."""
        if name == "ridge_height_m":
            return 0.0 if self.ridge is None else self.ridge[0][2]
        value: float = getattr(self, name)
        return value

    def with_number(self, name: FieldNumber, value: float) -> "FieldOfPlay":
        """Return the field with another value of a dimension, m. Raises `ValidationError` if the sport forbids it."""
        if name == "ridge_height_m":
            return self.changed({"ridge": self._ridge_at(value)})
        return self.changed({name: value, "ridge": self._stretched_ridge(name, value / self.number(name))})

    def changed(self, values: dict[str, Any]) -> "FieldOfPlay":
        """Return the field with other values. Raises `ValidationError` if the sport forbids them."""
        return FieldOfPlay.model_validate(self.model_dump() | values)

    def _ridge_at(self, height_m: float) -> list[Row]:
        """Return the ridge at another height; a flat field gets one between hips of 45°, as calibrations assume."""
        if self.ridge is not None:
            return [[x, y, height_m] for x, y, _ in self.ridge]
        end = max((self.length_m - self.width_m) / 2, 0.0)
        return [[0.0 - end, 0.0, height_m], [end, 0.0, height_m]]

    def _stretched_ridge(self, name: FieldNumber, times: float) -> list[Row] | None:
        """Return the ridge of the field with another length or width, stretched with it as calibrations do."""
        along, across = (times, 1.0) if name == "length_m" else (1.0, times)
        return None if self.ridge is None else [[along * x, across * y, z] for x, y, z in self.ridge]

    @property
    def warnings(self) -> list[str]:
        """Return a warning if length or width is the template's default and has no `sigma`."""
        if not isinstance(self.template, str) or not self.is_known:
            return []
        usual = load(self.template).size
        assumed = [
            name
            for name in ("length_m", "width_m")
            if name not in self.sigma and getattr(self, name) == usual[TEMPLATE_MEASURES[name]].default
        ]
        if not assumed:
            return []
        measures = " and ".join(f"{name} {getattr(self, name):g}" for name in assumed)
        is_guess = not self.sigma and any(usual[TEMPLATE_MEASURES[name]].chosen for name in assumed)
        example = ", ".join(f'"{name}": {0.05 if is_guess else 1}' for name in assumed)
        if is_guess:
            return [
                f"field: {measures}, as is usual for {self.template}, are taken to be as good as their digits, which "
                f"poses are then no better than: if somebody has measured this one, say how well by sigma {{{example}}}"
            ]
        return [
            f"field: {measures}, as is usual for {self.template}, are taken for measured, to 0.03 %: if nobody has "
            f"measured this one, say so by sigma {{{example}}}, or how well somebody has"
        ]

    @property
    def is_known(self) -> bool:
        """False if only a newer version has the template."""
        return not isinstance(self.template, str) or self.template in NAMES

    @property
    def plan(self) -> Template:
        """Markings, named points and unevenness of the ground."""
        return plan_of(self._template, self.uneven_m)

    @property
    def markings(self) -> tuple[Shape, ...]:
        """Markings of the field with its dimensions."""
        return markings_of(self._template, self.size)

    @property
    def _template(self) -> str | dict[str, Any]:
        """Name of the template, or the layout as `fields.plans` takes it."""
        return self.template if isinstance(self.template, str) else self.template.model_dump()

    @property
    def size(self) -> dict[str, float]:
        """Dimensions of the field by the template's names, m."""
        return size_of(dict(self))


class LengthRefused(ValueError):  # noqa: N818
    """Raised for a length beyond the template's `limits`; the message also asks if another unit was meant."""

    def __init__(self, limits: str, question: str) -> None:
        super().__init__(limits + question)
        self.limits = limits


def _must_lie(given: float, extent: Extent, what: str) -> None:
    if not extent.least <= given <= extent.most:
        units = [unit for unit, metres in OTHER_UNITS.items() if extent.least <= given * metres <= extent.most]
        question = f" (are these {' or '.join(units)}?)" if units else ""
        raise LengthRefused(f"{what}: {extent.least:g} to {extent.most:g} m, not {given:g}", question)
