"""Problems in the OpenAPI document: the types that each route can answer, by status."""

from collections.abc import Iterator
from http import HTTPStatus
from typing import Any

from service.routes.contract.documented import HEADERS, SCHEMAS
from service.schemas.names import problem_uri
from service.schemas.problems import MEDIA_TYPE, PROBLEM_TYPES, ProblemDetails

# Member of a response: the types of its problems.
TYPES = "x-problem-types"
OF_KEYS = (
    "key-missing",
    "key-unknown",
    "key-expired",
    "session-over",
    "scope-too-small",
    "origin-foreign",
    "host-unknown",
    "rate-limited",
    "too-many-unknown-keys",
)
OF_BODIES = ("malformed-request", "too-slow", "body-too-large", "encoded-body")
# Of files that should be pictures.
OF_IMAGES = ("empty-frame", "frame-too-large", "not-an-image", "broken-image", "truncated-image", "too-many-pixels")
# Of requests that make a job of files.
OF_UPLOADS = ("not-a-file", *OF_IMAGES, "callback-refused", "idempotency-key-reused", "queue-full", "disk-full")
OF_FRAMES = (*OF_UPLOADS, "unknown-camera", "missing-camera", "too-many-frames", "frame-size", "venue-replaced")
OF_SOURCES = ("source-refused", "source-failed")
# Statuses of problems that may pass: their answers can have a Retry-After.
MAY_BE_REPEATED = frozenset({HTTPStatus.CONFLICT, HTTPStatus.TOO_MANY_REQUESTS, HTTPStatus.SERVICE_UNAVAILABLE})
# Of exported poses.
OF_EXPORTS = ("unknown-camera", "camera-needed", "format-cannot-hold", "refined-not-found", "extra-missing")
OF_ADDRESSES = {
    "{venue_id}": ("venue-not-found", "unreadable"),
    "{job_id}": ("job-not-found", "unreadable"),
    "{camera}": ("no-such-camera",),
}


def problem_responses(*kinds: str) -> dict[int | str, dict[str, Any]]:
    """Return entries for `responses=` of a route that answers these problems, besides those of all such routes."""
    by_status: dict[int | str, dict[str, Any]] = {}
    for kind in kinds:
        by_status.setdefault(PROBLEM_TYPES[kind].status, {TYPES: []})[TYPES].append(problem_uri(kind))
    return by_status


# `responses=` of the application.
OF_ANY_ROUTE = problem_responses("invalid-request", "unavailable")


def document_problems(method: str, path: str, operation: dict[str, Any]) -> None:
    """Complete the problems of an operation by those that its address, its body and its key can bring."""
    responses = operation["responses"]
    for status, common in (OF_ANY_ROUTE | problem_responses(*_common_kinds(method, path, operation))).items():
        response = responses.setdefault(str(status), {})
        response[TYPES] = list(dict.fromkeys([*response.get(TYPES, ()), *common[TYPES]]))
    for status, response in responses.items():
        if TYPES in response:
            kinds = [address.rpartition("/")[2] for address in response[TYPES]]
            lines = [f"- `{problem_uri(kind)}`: {PROBLEM_TYPES[kind].title}." for kind in kinds]
            response["description"] = "\n".join([f"{HTTPStatus(int(status)).phrase}:", "", *lines])
            schema = {"$ref": f"{SCHEMAS}{ProblemDetails.__name__}"}
            response["content"] = response.get("content", {}) | {MEDIA_TYPE: {"schema": schema}}
            if int(status) in MAY_BE_REPEATED:
                response["headers"] = response.get("headers", {}) | {"Retry-After": HEADERS["Retry-After"]}


def _common_kinds(method: str, path: str, operation: dict[str, Any]) -> Iterator[str]:
    for part, kinds in OF_ADDRESSES.items():
        yield from kinds if part in path else ()
    if operation["security"]:
        yield from OF_KEYS
        # Who signed in on a page sends it with what changes something.
        yield from () if method == "get" else ("token-missing",)
        yield from () if "{venue_id}" in path or "{job_id}" in path else ("key-for-some-venues",)
    if "requestBody" in operation:
        yield from OF_BODIES
        yield "not-multipart" if "multipart/form-data" in operation["requestBody"]["content"] else "not-json"
