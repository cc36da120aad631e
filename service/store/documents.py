"""Venues and results as documents, which processes of several releases read and write in the same tables.

Release 0.1.0 refuses a document that has a field which it does not know. So a document stands in two columns: what
0.1.0 knows, and beside it, where 0.1.0 never looks, the `additions` of later releases. Those ignore fields that they
do not know, so a field that comes after 0.2.0 goes into the document itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from service.schemas.base import TOLERANTLY
from service.schemas.health import Alarm
from service.schemas.results import Result
from service.schemas.venue import Camera, Venue

Document = dict[str, Any]


@dataclass(frozen=True)
class Added:
    """The fields that 0.1.0 does not know: of a document itself, of parts of it, and of its cameras."""

    own: Collection[str]
    of_parts: Mapping[str, Collection[str]]
    of_cameras: Collection[str]


TO_VENUES = Added(
    own=["view", "recover"],
    of_parts={
        "alarms": ["trend_m", "knocked", "live"],
        "schedule": ["frames", "spacing_s"],
        "field": ["uneven_m", "sigma"],
    },
    of_cameras=["light"],
)
TO_RESULTS = Added(
    # `path` has words that 0.1.0 does not know; without it a result is told as one of a search.
    own=["warnings", "adoptable", "path"],
    of_parts={},
    of_cameras=[
        "light",
        "refined",
        "lens_change",
        "nights",
        "displacement",
        "cross_check",
        "knocked",
        "proposed",
        "seen_by_network",
    ],
)


def to_document(model: BaseModel) -> Document:
    """A model as it is stored: fields that have their defaults are left out, and need not be known to whoever reads."""
    document: Document = model.model_dump(mode="json", exclude_defaults=True)
    return document


def venue_columns(venue: Venue) -> tuple[Document, Document | None]:
    """The document of a venue, and its additions; None: there are none."""
    return _split(to_document(venue), TO_VENUES)


def result_columns(result: BaseModel) -> tuple[Document, Document | None]:
    """The document of a job's result, and its additions; None: there are none."""
    return _split(to_document(result), TO_RESULTS)


def stored_venue(document: Document, additions: Document | None) -> Venue:
    """Return the venue of two columns, whatever release wrote them. Read it inside `reading_row`."""
    return Venue.model_validate(join_additions(document, additions), **TOLERANTLY)


def stored_result(document: Document, additions: Document | None) -> Result:
    """Return the result of a calibration of two columns, whatever release wrote them. Read it inside `reading_row`."""
    return Result.model_validate(join_additions(document, additions), **TOLERANTLY)


def stored_alarm(row: Any) -> Alarm:
    """Return the alarm of a row, whose rule may be one of a newer version."""
    values = {"rule": row.rule, "camera": row.camera or None, "since": row.since, "why": row.why}
    return Alarm.model_validate(values, **TOLERANTLY)


def join_additions(document: Document, additions: Document | None) -> Document:
    """The whole document, without additions to a part or a camera that 0.1.0 has taken out of it."""
    if not additions:
        return document
    whole: Document = document | additions.get("own", {})
    for part, added in additions.get("of_parts", {}).items():
        if isinstance(whole.get(part), dict):
            whole[part] = whole[part] | added
    of_cameras = additions.get("of_cameras", {})
    if of_cameras:
        whole["cameras"] = [camera | of_cameras.get(camera["id"], {}) for camera in whole["cameras"]]
    return whole


def with_unknown_fields_of(before: Document, document: Document) -> Document:
    """A document of a venue with the fields of the one before it that this release does not know, of cameras as well.

    What a newer release has written must not be lost when this one moves a camera.
    """
    unknown = {camera["id"]: _unknown(camera, Camera) for camera in before["cameras"]}
    cameras = [unknown.get(camera["id"], {}) | camera for camera in document["cameras"]]
    return _unknown(before, Venue) | document | {"cameras": cameras}


def _unknown(document: Document, model: type[BaseModel]) -> Document:
    return {name: value for name, value in document.items() if name not in model.model_fields}


def _split(document: Document, added: Added) -> tuple[Document, Document | None]:
    parts = {part: _taken_out(document.get(part), names) for part, names in added.of_parts.items()}
    cameras = {camera["id"]: _taken_out(camera, added.of_cameras) for camera in document.get("cameras", ())}
    additions = {
        "own": _taken_out(document, added.own),
        "of_parts": {part: taken for part, taken in parts.items() if taken},
        "of_cameras": {camera: taken for camera, taken in cameras.items() if taken},
    }
    return document, {kind: taken for kind, taken in additions.items() if taken} or None


def _taken_out(document: Document | None, names: Collection[str]) -> Document:
    return {name: document.pop(name) for name in names if name in document} if document else {}
