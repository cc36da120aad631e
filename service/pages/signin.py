"""Signing in with an API key, and signing out."""

from http import HTTPStatus
from typing import Annotated
from urllib.parse import parse_qs, urlsplit

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from service.api.auth import COOKIE
from service.api.context import Context, InContext
from service.pages.page_rendering import HEADERS, SIGN_IN, Page, local_target, render_page
from service.routes.contract.documented import FOR_ALL
from service.routes.contract.guarded import Guarded
from service.schemas.problems import PROBLEM_TYPES, Problem

LONGEST_FORM = 8192
router = APIRouter(route_class=Page, include_in_schema=False)
out = APIRouter(route_class=Guarded, include_in_schema=False)


@router.get(SIGN_IN, openapi_extra=FOR_ALL)
async def sign_in_page(
    request: Request, context: InContext, wanted: Annotated[str, Query(alias="next", max_length=2048)] = "/"
) -> Response:
    """Show the form; redirect to the list of venues if the service needs no key."""
    if not await context.authenticator.asks_for_keys():
        return RedirectResponse("/", HTTPStatus.SEE_OTHER)
    return render_page(request, "sign_in.html", next=local_target(wanted), problem=None)


@router.post(SIGN_IN, openapi_extra=FOR_ALL)
async def sign_in(request: Request, context: InContext) -> Response:
    """Begin a session for a valid key."""
    _require_own_page(request)
    form = await _form(request)
    target = local_target(form.get("next", "/"))
    try:
        session = await context.authenticator.sign_in(request, form.get("key", ""))
    except Problem as problem:
        status = PROBLEM_TYPES[problem.kind].status
        return render_page(request, "sign_in.html", status, next=target, problem=problem)
    answer = RedirectResponse(target, HTTPStatus.SEE_OTHER, HEADERS)
    answer.set_cookie(
        COOKIE,
        session,
        max_age=round(3600 * context.settings.session_hours),
        path=_cookie_path(context),
        httponly=True,
        samesite="strict",
        secure=_over_tls(request),
    )
    return answer


@out.post("/ui/sign-out", openapi_extra=FOR_ALL)
async def sign_out(request: Request, context: InContext) -> Response:
    """End the session, if there is one."""
    _require_own_page(request)
    await context.authenticator.sign_out(request)
    answer = Response(status_code=HTTPStatus.NO_CONTENT)
    answer.delete_cookie(
        COOKIE, path=_cookie_path(context), httponly=True, samesite="strict", secure=_over_tls(request)
    )
    return answer


def _cookie_path(context: Context) -> str:
    return context.settings.root_path or "/"


def _require_own_page(request: Request) -> None:
    """Raise `Problem` for a request from a page of another site (CSRF).

    Browsers send `Sec-Fetch-Site` to trustworthy addresses (https, or localhost), and `Origin` to all.
    """
    site, origin = request.headers.get("sec-fetch-site"), request.headers.get("origin")
    foreign = site != "same-origin" if site else origin and urlsplit(origin).netloc != request.headers.get("host")
    if foreign:
        raise Problem("origin-foreign", "Sign in on a page of this service.", got=(origin or site or "")[:200])


async def _form(request: Request) -> dict[str, str]:
    """Return the fields of a URL-encoded form."""
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > LONGEST_FORM:
            raise Problem("body-too-large", "A key is shorter.")
    return {name: values[0] for name, values in parse_qs(body.decode("utf-8", "replace")).items()}


def _over_tls(request: Request) -> bool:
    """True if the browser uses https, to this service or to the proxy in front of it."""
    return request.url.scheme == "https" or request.headers.get("x-forwarded-proto", "") == "https"
