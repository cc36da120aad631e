"""How the routes' problems appear in the OpenAPI document."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from service.problems import MEDIA_TYPE
from service.schemas import ProblemDetails


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Entries for `responses=` of a route."""
    schema = ProblemDetails.model_json_schema()
    return {
        status: {"description": HTTPStatus(status).phrase, "content": {MEDIA_TYPE: {"schema": schema}}}
        for status in statuses
    }
