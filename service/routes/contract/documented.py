"""Problems, uploads and scopes in the OpenAPI document."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.schemas.events.venue_event import Event
from service.schemas.find import SoughtSite
from service.schemas.health import AlarmEvent
from service.schemas.job import Job, JobEvent
from service.schemas.names import OPTIONS_PART, Scope
from service.schemas.options import FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions, Options
from service.schemas.problems import MEDIA_TYPE, ProblemDetails

# Models that no route takes or returns as a JSON body, and that a generated client should still know by name.
MODELS = (Options, IntrinsicsOptions, LocateOptions, FieldOptions, FindOptions, SoughtSite, ProblemDetails)
SCHEMAS = "#/components/schemas/"
KEY_SCHEME = "key"
SECURITY_SCHEMES = {
    KEY_SCHEME: {
        "type": "http",
        "scheme": "bearer",
        "description": "A key made by `esc key add`. `calibrate` includes `read`, `admin` includes both. A service "
        "that listens on loopback and has no keys asks for none.",
    }
}
HEADERS: dict[str, dict[str, Any]] = {
    "ETag": {"description": "For If-None-Match and If-Match.", "schema": {"type": "string"}},
    "Location": {"description": "The job.", "schema": {"type": "string", "format": "uri-reference"}},
    "Retry-After": {"description": "In seconds.", "schema": {"type": "integer", "minimum": 0}},
}
FILE: dict[str, Any] = {"type": "string", "format": "binary"}
BINARY = {"schema": FILE}
# `openapi_extra` of a route that anybody may call.
FOR_ALL: dict[str, Any] = {"security": []}


class DocumentedApp(FastAPI):
    """FastAPI with these models among the schemas of its document, and sentences as summaries of its routes."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI document."""
        document = super().openapi()
        for model in MODELS:
            schema = model.model_json_schema(ref_template=f"{SCHEMAS}{{model}}")
            document["components"]["schemas"] |= schema.pop("$defs", {}) | {model.__name__: schema}
        document["components"]["securitySchemes"] = SECURITY_SCHEMES
        for path in (*document["paths"].values(), *document["webhooks"].values()):
            for operation in path.values():
                operation["summary"] = _first_sentence(operation["description"])
        return document


def _first_sentence(description: str) -> str:
    """Return the first sentence of a route's description as plain text: it says more than the function's name."""
    first = re.split(r"(?<=\.)\s", description, maxsplit=1)[0]
    return " ".join(first.removesuffix(".").replace("`", "").split())


def document_callback(app: FastAPI) -> None:
    """Document the webhook that a `callback_url` of a job gets."""

    @app.webhooks.post("job-ended", status_code=204, tags=["jobs"])
    def job_ended(event: JobEvent) -> None:
        """Sent when a job with a `callback_url` has ended, until it is answered with 2xx: ten more times in a day.

        `webhook-id`, `webhook-timestamp` and `webhook-signature` are those of Standard Webhooks (`v1`, HMAC-SHA256 with
        the secret of the service). The same event can arrive more than once; its `webhook-id` is the job's.
        """


def document_alarms(app: FastAPI) -> None:
    """Document the webhook that the `callback_url` of a venue's alarms gets."""

    @app.webhooks.post("alarm", status_code=204, tags=["venues"])
    def alarm(event: AlarmEvent) -> None:
        """Sent once when an alarm of a venue begins and once when it is over, signed and retried as `job-ended` is."""


def document_events(app: FastAPI) -> None:
    """Document the events that the `webhooks` of a venue get."""

    @app.webhooks.post("venue-event", status_code=204, tags=["venues"])
    def venue_event(event: Event) -> None:
        """Sent to each of a venue's `webhooks` that wants it, signed and retried as `job-ended` is.

        One that had to be tried again can arrive after a later one: of two with poses, the higher `revision` holds.
        """


def schema_reference(model: type[BaseModel]) -> dict[str, str]:
    """Return a schema that refers to one of `MODELS`."""
    return {"$ref": f"{SCHEMAS}{model.__name__}"}


def form_body(
    options: type[BaseModel],
    description: str,
    *,
    needed: Sequence[str] = (),
    parts: Mapping[str, Any] | None = None,
    others: Mapping[str, Any] | bool = FILE,
    required: bool = True,
) -> dict[str, Any]:
    """Return the body of a route that takes a form: `options`, further `parts`, and `others` of any other name."""
    schema = {
        "type": "object",
        "description": description,
        "properties": {OPTIONS_PART: schema_reference(options), **(parts or {})},
        "additionalProperties": others,
        **({"required": list(needed)} if needed else {}),
    }
    encoding = {OPTIONS_PART: {"contentType": "application/json"}}
    content = {"multipart/form-data": {"schema": schema, "encoding": encoding}}
    return {"requestBody": {"required": required, "content": content}}


def frames_form_body(options: type[BaseModel], *, required: bool = True) -> dict[str, Any]:
    """Return the body of a route that takes frames of all cameras of a venue; not `required` if it can fetch them."""
    # Its parts are no arrays: generators write code for a repeated part of any name that does not compile.
    return form_body(
        options,
        "A JPEG or PNG file per camera, the part named by the camera's id; repeat a part to send several frames of a "
        "camera: they are laid onto each other, so that its shaking blurs no line, and what walks by vanishes.",
        required=required,
    )


def submission_responses(known: str = "This content is already a job") -> dict[int | str, dict[str, Any]]:
    """Return entries for `responses=` of a route that makes a job; `known`: description where there is no new one."""
    return {
        200: {"model": Job, "description": known, **header_docs("ETag")},
        202: header_docs("ETag", "Location", "Retry-After"),
    }


def needs_scope(scope: Scope) -> dict[str, Any]:
    """Return `openapi_extra` of a route that needs a key: OpenAPI 3.1 lets requirements of any scheme list roles."""
    return {"security": [{KEY_SCHEME: [scope]}]}


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return entries for `responses=` of a route that answers problems with these statuses."""
    content = {MEDIA_TYPE: {"schema": schema_reference(ProblemDetails)}}
    return {status: {"description": HTTPStatus(status).phrase, "content": content} for status in statuses}


def header_docs(*names: str) -> dict[str, Any]:
    """Return the part of an entry for `responses=` that names headers, which the answer always has."""
    return {"headers": {name: {"required": True, **HEADERS[name]} for name in names}}
