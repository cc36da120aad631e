"""The inputs of a calibration as plain records: the task as its parent wrote it, which has checked it already.

They are parts of the wire's models, under the same names, without what an engine has no use for. The models themselves
take longer to load than a near job takes to refine a camera. A test compares the two, field by field.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, dataclass_transform, get_args, get_origin, get_type_hints

from fields.plans import other_shapes, plan_of, size_of
from fields.shapes import Shape
from fields.template import Template
from service.schemas.lens_map import lens_warnings
from service.schemas.names import LensModel, SigmaSource

R = TypeVar("R", bound="Record")
_HINTS: dict[type[Any], dict[str, Any]] = {}


@dataclass_transform(kw_only_default=True, frozen_default=True)
class Record:
    """A plain record of annotated fields. To type checkers a frozen dataclass, which takes longer to make than to fill.

    Records are compared by identity, not by value.
    """

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)


class Pose(Record):
    """See `service.schemas.geometry.Pose`."""

    rotation: list[float]
    position: list[float]


class Intrinsics(Record):
    """See `service.schemas.geometry.Intrinsics`."""

    model: LensModel
    matrix: list[list[float]]
    distortion: list[float]
    sigma: dict[str, float] | None
    sigma_from: SigmaSource | None


class Light(Record):
    """See `service.schemas.geometry.Light`."""

    gain: list[float]
    contrast: float
    falloff: float
    reach: float


class PosedCamera(Record):
    """See `service.schemas.geometry.PosedCamera`."""

    id: str
    image_size: list[int]
    intrinsics: Intrinsics
    pose: Pose


class Camera(PosedCamera):
    """See `service.schemas.venue.Camera`."""

    ignore: list[list[list[float]]]
    light: Light | None


class FieldOfPlay(Record):
    """See `service.schemas.field.FieldOfPlay`; a layout and other markings are what `fields.plans` takes."""

    template: str | dict[str, Any]
    length_m: float
    width_m: float
    line_width_m: float
    measures_m: dict[str, float]
    ridge: list[list[float]] | None
    uneven_m: float | None
    sigma: dict[str, float]
    other_markings: list[dict[str, Any]]

    @property
    def plan(self) -> Template:
        """Markings and named points, and how uneven their ground is."""
        return plan_of(self.template, self.uneven_m)

    @property
    def others(self) -> list[Shape]:
        """Other markings that are painted on the ground."""
        return other_shapes(self.other_markings, size_of(vars(self)))


class Venue(Record):
    """See `service.schemas.venue.Venue`."""

    field: FieldOfPlay
    cameras: list[Camera]
    accept: str
    lens: str
    recover: Literal["propose", "accept"]

    @property
    def lights(self) -> dict[str, Light]:
        """How cameras are evened out with the others, by the ids of those of which it is known."""
        return {camera.id: camera.light for camera in self.cameras if camera.light is not None}

    @property
    def lens_warnings(self) -> list[str]:
        """What is doubtful about the lenses of its cameras, a line each."""
        return [words for camera in self.cameras for words in lens_warnings(camera)]


class Options(Record):
    """See `service.schemas.options.Options`; all of them but `callback_url`, which is told to nobody."""

    priority: str
    timeout_s: float | None
    preset: str
    search: str
    seed: int | None
    generations: int
    parents: int
    offspring: int
    stitch_weight: float
    flat: bool
    fit_focal_length: bool
    fit_ridge: bool
    dry_run: bool
    pictures: bool


class View(Record):
    """See `service.schemas.results.View`."""

    lines_found: float | None
    blur_px: float | None


class Anchor(Record):
    """See `service.schemas.trend.Anchor`."""

    revision: int
    posed: PosedCamera


class Task(Record):
    """See `service.store.jobs.task.Task`."""

    venue: Venue
    options: Options
    last_views: dict[str, View]
    memories: dict[str, dict[str, Any]]
    taken_at: datetime | None
    anchors: dict[str, Anchor]


def read_record(kind: type[R], document: Mapping[str, Any]) -> R:
    """Return the record of a document, the JSON of the model that the record is a part of; nothing is checked."""
    return kind(**{name: _read(hint, document[name]) for name, hint in _hints(kind).items()})


def _hints(kind: type[Any]) -> dict[str, Any]:
    """The types of the fields of a record."""
    if kind not in _HINTS:
        _HINTS[kind] = get_type_hints(kind)
    return _HINTS[kind]


def _read(hint: Any, value: Any) -> Any:
    """Return a JSON value as what it is annotated to be."""
    if get_origin(hint) in (Union, UnionType):
        if value is None:
            return None
        # Of a field that is a name or a document neither needs to be read.
        (hint, *others) = (one for one in get_args(hint) if one is not NoneType)
        return value if others else _read(hint, value)
    if get_origin(hint) is list:
        (of,) = get_args(hint)
        return [_read(of, one) for one in value] if _is_read(of) else value
    if get_origin(hint) is dict:
        _, of = get_args(hint)
        return {name: _read(of, one) for name, one in value.items()} if _is_read(of) else value
    if _is_record(hint):
        return read_record(hint, value)
    return datetime.fromisoformat(value) if hint is datetime else value


def _is_read(hint: Any) -> bool:
    """Whether values of a type are other ones than those of JSON."""
    return _is_record(hint) or hint is datetime


def _is_record(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, Record)
