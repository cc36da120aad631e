"""Explanations of problems and of rejected poses, as pages for browsers at addresses where programs get JSON."""

from http import HTTPStatus
from typing import Annotated, Any

from fastapi import APIRouter, FastAPI, Path, Request, Response
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.routing import Match

from service.pages import documents
from service.pages.page_rendering import Page, problem_page, render_page
from service.routes.contract.documented import FOR_ALL
from service.schemas.problems import PROBLEM_TYPES, REFUSAL_REASONS, REFUSALS_DOCUMENT, Problem

DOCUMENT_NAME = REFUSALS_DOCUMENT.rpartition("/")[2].removesuffix(".md")
JOBS_THAT_FAIL = "jobs-that-fail"
Name = Annotated[str, Path(max_length=64)]


class ForBrowsers(Page):
    """A page for browsers, at an address where other clients get JSON."""

    def matches(self, scope: Any) -> tuple[Match, Any]:
        """Match only requests that prefer HTML."""
        match, child = super().matches(scope)
        if match is not Match.NONE and not wants_page(Headers(scope=scope).get("accept", "")):
            return Match.NONE, {}
        return match, child


router = APIRouter(route_class=ForBrowsers, include_in_schema=False)
document_router = APIRouter(route_class=Page, include_in_schema=False)


def wants_page(accept: str) -> bool:
    """True if an `Accept` header prefers HTML to any JSON type (RFC 9110, section 12.5.1)."""
    quality = {"html": 0.0, "json": 0.0}
    for part in accept.lower().split(","):
        media_type, *parameters = (piece.strip() for piece in part.split(";"))
        for kind in quality:
            if media_type == f"text/{kind}" or (kind == "json" and media_type.endswith(("/json", "+json"))):
                quality[kind] = max(quality[kind], _quality(parameters))
    return quality["html"] > quality["json"]


def _quality(parameters: list[str]) -> float:
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            try:
                return float(value)
            except ValueError:
                return 0.0
    return 1.0


@router.get("/refusals", openapi_extra=FOR_ALL)
def refusals(request: Request) -> Response:
    """List every reason for rejecting a pose, with advice."""
    reasons = {f"/refusals/{name}": (known.title, known.do) for name, known in REFUSAL_REASONS.items()}
    return _for_browsers(render_page(request, "reasons.html", title="Reasons for refusals", reasons=reasons))


@router.get("/problems", openapi_extra=FOR_ALL)
def problems(request: Request) -> Response:
    """List every kind of problem."""
    kinds = {f"/problems/{name}": (known.title, None) for name, known in PROBLEM_TYPES.items()}
    return _for_browsers(render_page(request, "reasons.html", title="Problems", reasons=kinds))


@router.get("/refusals/{reason}", openapi_extra=FOR_ALL)
def refusal(reason: Name, request: Request) -> Response:
    """Explain a reason for rejecting a pose, with advice."""
    if reason not in REFUSAL_REASONS:
        raise Problem("not-found", "There is no such reason for a refusal.")
    known = REFUSAL_REASONS[reason]
    return _explained(
        request,
        known.title,
        documents.reason(DOCUMENT_NAME, known.anchor, reason),
        known.anchor,
        looks_like=known.looks_like,
        do=known.do,
    )


@router.get("/problems/{kind}", openapi_extra=FOR_ALL)
def problem(kind: Name, request: Request) -> Response:
    """Explain a kind of problem, with advice if jobs can end with it."""
    if kind not in PROBLEM_TYPES:
        raise Problem("not-found", "There is no such kind of problem.")
    of_jobs = documents.section(DOCUMENT_NAME, JOBS_THAT_FAIL)
    body = of_jobs if f"<code>{kind}</code>" in of_jobs else None
    return _explained(
        request, PROBLEM_TYPES[kind].title, body, JOBS_THAT_FAIL, answered_with=PROBLEM_TYPES[kind].status
    )


@document_router.get("/ui/documents/{name}", openapi_extra=FOR_ALL)
def document(name: Name, request: Request) -> Response:
    """Show a document."""
    if name not in documents.NAMES:
        raise Problem("not-found", f"The documents that are shown here are {', '.join(documents.NAMES)}.")
    return render_page(request, "document.html", title=documents.title(name), body=documents.whole(name))


def _explained(request: Request, title: str, body: Any, anchor: str, **more: Any) -> Response:
    page = render_page(
        request,
        "explained.html",
        title=title,
        body=body,
        document=documents.address(DOCUMENT_NAME, anchor),
        document_title=documents.title(DOCUMENT_NAME),
        **{"looks_like": None, "do": None, "answered_with": None} | more,
    )
    return _for_browsers(page)


def _for_browsers(page: Response) -> Response:
    """Mark a page whose address has JSON for other clients, for caches."""
    page.headers["Vary"] = "Accept"
    return page


def show_browsers_what_is_missing(app: FastAPI) -> None:
    """Answer browsers at an unknown address with a page; other clients get the same JSON as before."""
    as_json: Any = app.exception_handlers[HTTPException]

    async def answer(request: Request, error: HTTPException) -> Response:
        if error.status_code == HTTPStatus.NOT_FOUND and wants_page(request.headers.get("accept", "")):
            return _for_browsers(problem_page(request, Problem("not-found", f"Nothing is at {request.url.path}.")))
        response: Response = await as_json(request, error)
        return response

    app.add_exception_handler(HTTPException, answer)  # type: ignore[arg-type]
