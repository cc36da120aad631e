"""Error handlers: every error of the application becomes a problem (RFC 9457)."""

import json
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.routing import iter_route_contexts
from pydantic import ValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import compile_path

from service.schemas.findings import describe_errors
from service.schemas.merge_patch import MEDIA_TYPE as MERGE_PATCH
from service.schemas.problems import MEDIA_TYPE, PROBLEM_TYPES, Problem
from service.store.unreadable import UnreadableRow

MOST_ERRORS = 100
log = structlog.get_logger()


def problem_response(problem: Problem) -> Response:
    """Return the HTTP response, escaped to ASCII: a client's lone surrogates must not break it."""
    content = json.dumps(problem.members(), ensure_ascii=True).encode("ascii")
    return Response(content, PROBLEM_TYPES[problem.kind].status, problem.headers, MEDIA_TYPE)


def validation_problem(
    error: ValidationError | RequestValidationError, model: Any, document: Any, *inside: str
) -> Problem:
    """Return the problem of a document that a schema refuses, with the place of each error.

    `model`, `document`: see `describe_errors`. A document of a megabyte can have a hundred thousand errors; the first
    ones are enough to mend it.
    """
    everything = error.errors()
    found = everything[:MOST_ERRORS]
    places = [".".join(str(step) for step in (*inside, *finding["loc"])) for finding in found]
    messages = describe_errors(found, model, document)
    findings = [{"where": where, "message": message} for where, message in zip(places, messages, strict=True)]
    if len(everything) == len(found):
        return Problem("invalid-request", messages[0], errors=findings)
    return Problem("invalid-request", messages[0], errors=findings, errors_left_off=len(everything) - len(found))


def unreadable_problem(error: UnreadableRow) -> Problem:
    """Return the problem of a stored row that cannot be read."""
    here = f"/{error.kind}s/{error.id}"
    ways_out = {
        "venue": f"POST {here}/restore with a revision of GET {here}/history, PUT {here} anew, or DELETE it.",
        "job": f"DELETE {here}, and send its frames again.",
    }
    what_to_do = ways_out.get(error.kind, "Restore another revision of the venue, or PUT it anew.")
    return Problem("unreadable", f"The {error}. {what_to_do}", what=error.kind, id=error.id)


def not_json(request: Request) -> Problem:
    """Return the problem of a document that came as another media type."""
    got = request.headers.get("content-type", "")[:200]
    # RFC 5789, section 2.2.
    headers = {"Accept-Patch": MERGE_PATCH} if request.method == "PATCH" else None
    return Problem("not-json", "Send it with Content-Type: application/json.", headers=headers, got=got)


def install_handlers(app: FastAPI) -> None:
    """Answer every error of `app` with a problem."""

    @app.exception_handler(Problem)
    async def problem(_: Request, error: Problem) -> Response:
        return problem_response(error)

    @app.exception_handler(RequestValidationError)
    async def validation(request: Request, error: RequestValidationError) -> Response:
        if any(finding["type"] == "json_invalid" for finding in error.errors()):
            return problem_response(Problem("malformed-request", "The body is not JSON."))
        if isinstance(error.body, bytes):
            return problem_response(not_json(request))
        return problem_response(_invalid_request(request, error))

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> Response:
        if error.status_code < 400:
            return Response(status_code=error.status_code, headers=error.headers)
        return problem_response(_from_http(request, error))

    @app.exception_handler(ClientDisconnect)
    async def gone(_: Request, __: Exception) -> Response:
        return problem_response(Problem("malformed-request", "The request broke off."))

    @app.exception_handler(UnreadableRow)
    async def unreadable(_: Request, error: UnreadableRow) -> Response:
        return problem_response(unreadable_problem(error))

    @app.exception_handler(Exception)
    async def unexpected(_: Request, error: Exception) -> Response:
        log.error("unexpected error", exc_info=error)
        return problem_response(Problem("internal-error", "This is a fault of the service; its log has the details."))


def _invalid_request(request: Request, error: RequestValidationError) -> Problem:
    """Return the problem of an invalid request; places in its body begin with `body`, whatever FastAPI calls it."""
    field = getattr(request.scope.get("route"), "body_field", None)
    return validation_problem(error, None if field is None else field.field_info.annotation, error.body)


def _from_http(request: Request, error: HTTPException) -> Problem:
    match error.status_code:
        case 404:
            return Problem("not-found", f"Nothing is at {request.url.path}; /docs lists what there is.")
        case 405:
            allowed = ", ".join(sorted(_methods_at(request)))
            return Problem("method-not-allowed", f"Allowed methods: {allowed}.", headers={"Allow": allowed})
        case 413:
            return Problem("body-too-large", str(error.detail), headers=error.headers)
        case _:
            return Problem("malformed-request", str(error.detail), headers=error.headers)


def _methods_at(request: Request) -> set[str]:
    """Return all methods of an address; the router itself names those of one of its routes."""
    path = request.scope["path"]
    routes = iter_route_contexts(request.app.routes)
    here = [route for route in routes if route.path is not None and compile_path(route.path)[0].match(path)]
    methods = {method for route in here for method in route.methods or ()}
    return methods | {"HEAD"} if "GET" in methods else methods
