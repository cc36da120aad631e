"""The OpenAPI document: names of schemas by direction, webhooks, problems by route."""

import json
import re
from typing import Any

from fastapi import FastAPI

from service.routes.contract.documented import KEY_SCHEME, SCHEMAS, SENT
from service.routes.contract.problem_docs import document_problems
from service.schemas.check import CheckOptions
from service.schemas.events.venue_event import Event
from service.schemas.find import SoughtSite
from service.schemas.health import AlarmEvent
from service.schemas.job import JobEvent
from service.schemas.options import FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions, Options
from service.schemas.problems import ProblemDetails

SECURITY_SCHEMES = {
    KEY_SCHEME: {
        "type": "http",
        "scheme": "bearer",
        "description": "A key made by `esc key add`. `calibrate` includes `read`, `admin` includes both. A service "
        "that listens on loopback and has no keys asks for none.",
    }
}
# Webhook of the document in the making alone: it names what no route takes or returns as a JSON body.
PARTS_OF_FORMS = "parts-of-forms"


class DocumentedApp(FastAPI):
    """FastAPI whose document suits generators of clients."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI document."""
        if self.openapi_schema is None:
            self.openapi_schema = _finished(super().openapi())
        return self.openapi_schema


def document_webhooks(app: FastAPI) -> None:
    """Document what the service sends to the addresses that it is given. The `response_model` is what is sent."""

    @app.webhooks.post("job-ended", operation_id="receive_job_end", response_model=JobEvent, tags=["jobs"])
    def job_ended() -> None:
        """Sent when a job with a `callback_url` has ended, until it is answered with 2xx: ten more times in a day.

        `webhook-id`, `webhook-timestamp` and `webhook-signature` are those of Standard Webhooks (`v1`, HMAC-SHA256 with
        the secret of the service). The same event can arrive more than once; its `webhook-id` is the job's.
        """

    @app.webhooks.post("alarm", operation_id="receive_alarm", response_model=AlarmEvent, tags=["venues"])
    def alarm() -> None:
        """Sent once when an alarm of a venue begins and once when it is over, signed and retried as `job-ended` is."""

    @app.webhooks.post("venue-event", operation_id="receive_venue_event", response_model=Event, tags=["venues"])
    def venue_event() -> None:
        """Sent to each of a venue's `webhooks` that wants it, signed and retried as `job-ended` is.

        One that had to be tried again can arrive after a later one: of two with poses, the higher `revision` holds.
        Later versions send events of other types, which a client answers with 2xx and ignores.
        """

    @app.webhooks.post(PARTS_OF_FORMS, response_model=ProblemDetails)
    def parts_of_forms(
        sent: Options | IntrinsicsOptions | LocateOptions | FieldOptions | FindOptions | CheckOptions | SoughtSite,
    ) -> None:
        """Name the schemas of forms and problems."""


def _finished(document: dict[str, Any]) -> dict[str, Any]:
    """Return FastAPI's document with all that FastAPI does not know of the interface."""
    webhooks = document["webhooks"]
    del webhooks[PARTS_OF_FORMS]
    for hook in webhooks.values():
        sent = hook["post"]["responses"].pop("200")["content"]
        hook["post"] |= {"requestBody": {"required": True, "content": sent}}
        hook["post"]["responses"] = {"2XX": {"description": "It arrived: anything else is tried again."}}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            document_problems(method, path, operation)
    for path in (*document["paths"].values(), *webhooks.values()):
        for operation in path.values():
            operation["summary"] = _first_sentence(operation["description"])
    document["components"]["securitySchemes"] = SECURITY_SCHEMES
    # FastAPI's own, which no route answers.
    for unused in ("HTTPValidationError", "ValidationError"):
        document["components"]["schemas"].pop(unused, None)
    return _with_short_names(document)


def _with_short_names(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with `Lens` for what is answered and `LensIn` for what is sent, where the two differ.

    FastAPI calls them `Lens-Output` and `Lens-Input`.
    """
    schemas = document["components"]["schemas"]
    short = {name: _short_name(name) for name in schemas}
    if len(set(short.values())) < len(short):
        raise ValueError(f"two schemas have one name: {sorted(short.values())}")
    # Some generators name their models by the titles.
    document["components"]["schemas"] = {
        short[name]: schemas[name] | {"title": short[name]} for name in sorted(schemas, key=short.__getitem__)
    }

    def renamed(reference: re.Match[str]) -> str:
        # A model that is sent alone has no direction in its name.
        return reference[1] + short.get(reference[2], reference[2].removesuffix(SENT))

    named: dict[str, Any] = json.loads(re.sub(rf"({SCHEMAS})([\w.-]+)", renamed, json.dumps(document)))
    return named


def _short_name(name: str) -> str:
    model, _, direction = name.partition("-")
    return {"": model, "Input": model.removesuffix("In") + "In", "Output": model.removesuffix("In")}[direction]


def _first_sentence(description: str) -> str:
    """Return the first sentence of a route's description as plain text: it says more than the function's name."""
    first = re.split(r"(?<=\.)\s", description, maxsplit=1)[0]
    return " ".join(first.removesuffix(".").replace("`", "").split())
