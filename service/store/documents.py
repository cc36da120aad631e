"""Venues, results and alarms as stored documents, which processes of several versions read and write.

A process ignores the fields of a document that it does not know, and keeps them when it changes a venue.
"""

from typing import Any

from pydantic import BaseModel

from service.schemas.base import TOLERANTLY
from service.schemas.health import Alarm
from service.schemas.results import Result
from service.schemas.venue import Camera, Venue

Document = dict[str, Any]


def to_document(model: BaseModel) -> Document:
    """Return a model as it is stored: without fields that have their defaults, which no reader needs to know."""
    document: Document = model.model_dump(mode="json", exclude_defaults=True)
    return document


def stored_venue(document: Document) -> Venue:
    """Return the venue of a document, whatever version wrote it. Call it inside `reading_row`."""
    return Venue.model_validate(document, **TOLERANTLY)


def stored_result(document: Document) -> Result:
    """Return the result of a calibration, whatever version wrote it. Call it inside `reading_row`."""
    return Result.model_validate(document, **TOLERANTLY)


def stored_alarm(row: Any) -> Alarm:
    """Return the alarm of a row, whose rule may be one of a newer version."""
    values = {"rule": row.rule, "camera": row.camera or None, "since": row.since, "why": row.why}
    return Alarm.model_validate(values, **TOLERANTLY)


def with_unknown_fields_of(before: Document, document: Document) -> Document:
    """Return a venue's document with those fields of the one before, of cameras as well, that this version ignores.

    What a newer version has written must not be lost when this one moves a camera.
    """
    unknown = {camera["id"]: _unknown(camera, Camera) for camera in before["cameras"]}
    cameras = [unknown.get(camera["id"], {}) | camera for camera in document["cameras"]]
    return _unknown(before, Venue) | document | {"cameras": cameras}


def _unknown(document: Document, model: type[BaseModel]) -> Document:
    return {name: value for name, value in document.items() if name not in model.model_fields}
