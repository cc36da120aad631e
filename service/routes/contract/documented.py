"""Uploads, headers and scopes in the OpenAPI document."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from service.schemas.names import OPTIONS_PART, Scope

SCHEMAS = "#/components/schemas/"
KEY_SCHEME = "key"
# FastAPI's ending of the name of a model that is both sent and answered, as it is sent.
SENT = "-Input"
HEADERS: dict[str, dict[str, Any]] = {
    "ETag": {"description": "For If-None-Match and If-Match.", "schema": {"type": "string"}},
    "Location": {"description": "The job.", "schema": {"type": "string", "format": "uri-reference"}},
    "Retry-After": {"description": "In seconds.", "schema": {"type": "integer", "minimum": 0}},
}
FILE: dict[str, Any] = {"type": "string", "format": "binary"}
BINARY = {"schema": FILE}
PICTURE = {"image/jpeg": BINARY, "image/png": BINARY}
# `openapi_extra` of a route that anybody may call.
FOR_ALL: dict[str, Any] = {"security": []}


def sent_reference(model: type[BaseModel]) -> dict[str, str]:
    """Return a schema that refers to a model which clients send as a part of a form."""
    return {"$ref": f"{SCHEMAS}{model.__name__}{SENT}"}


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
        "properties": {OPTIONS_PART: sent_reference(options), **(parts or {})},
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


def needs_scope(scope: Scope) -> dict[str, Any]:
    """Return `openapi_extra` of a route that needs a key: OpenAPI 3.1 lets requirements of any scheme list roles."""
    return {"security": [{KEY_SCHEME: [scope]}]}


def header_docs(*names: str) -> dict[str, Any]:
    """Return the part of an entry for `responses=` that names headers, which the answer always has."""
    return {"headers": {name: {"required": True, **HEADERS[name]} for name in names}}
