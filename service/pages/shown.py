"""How a page leaves: rendered with what every page needs, under a strict policy, and with problems as pages too."""

from __future__ import annotations

import re
from collections.abc import Callable, Coroutine
from http import HTTPStatus
from importlib.metadata import version
from typing import Any
from urllib.parse import quote

import structlog
from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.responses import HTMLResponse, RedirectResponse

from service.api.auth import COOKIE, SCOPES, page_token
from service.pages import words
from service.pages.assets import address
from service.pages.seam import seam_curve
from service.pages.trend_curves import trend_curves
from service.routes.contract.guarded import Guarded
from service.store.engine import AWAY
from service.store.keys import Key
from service.wire.names import Scope
from service.wire.problems import KINDS, REASONS, Problem

SIGN_IN = "/ui/sign-in"
# Scripts, styles and pictures are files of this service; nothing inline, nobody frames it.
POLICY = "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "same-origin",
    # The numbers are of this moment, and whoever signs out leaves nothing behind.
    "Cache-Control": "no-store",
}
log = structlog.get_logger()
templates = Environment(
    loader=PackageLoader("service.pages"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
templates.globals |= {
    "static": address,
    "version": version("esc-calibration"),
    "seam_curve": seam_curve,
    "trend_curves": trend_curves,
    "reasons": REASONS,
}
templates.filters |= {
    "figure": words.figure,
    "cm": words.centimetres,
    "on_the_pitch": words.on_the_pitch,
    "degrees": words.degrees,
    "percent": words.percent,
    "longer": words.longer,
    "capitalised": words.capitalised,
    "ago": words.ago,
    "moment": words.moment,
    "seconds": words.seconds,
}


class Page(Guarded):
    """A route that answers with a page, whatever happens; who is not signed in is sent to where one does it."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Handle, and put into words what goes wrong."""
        handle = super().get_route_handler()

        async def shown(request: Request) -> Response:
            try:
                return await handle(request)
            except Problem as problem:
                return refusal(request, problem)
            except RequestValidationError:
                return refusal(request, Problem("not-found", "The address is not one of this service's."))
            except AWAY:
                log.warning("cannot show a page", exc_info=True)
                return refusal(request, Problem("unavailable", "Its storage does not answer. Try again in a moment."))

        return shown


def page(request: Request, template: str, status: int = 200, **content: Any) -> Response:
    """A page from its template."""
    key: Key | None = getattr(request.state, "key", None)
    token = request.cookies.get(COOKIE)
    text = templates.get_template(template).render(
        key=key,
        token=page_token(token) if key and token else "",
        may=lambda scope: may(key, scope),
        path=request.url.path,
        **content,
    )
    return HTMLResponse(text, status, HEADERS)


def may(key: Key | None, needed: Scope) -> bool:
    """Whether the owner of a key may do what needs this scope; anybody may where no keys are asked for."""
    return key is None or SCOPES.index(key.scope) >= SCOPES.index(needed)


def refusal(request: Request, problem: Problem) -> Response:
    """A problem as a page, or the way to sign in."""
    status = KINDS[problem.kind].status
    if status == HTTPStatus.UNAUTHORIZED:
        wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        return RedirectResponse(f"{SIGN_IN}?next={quote(wanted)}", HTTPStatus.SEE_OTHER)
    return page(request, "problem.html", status, problem=problem, title=KINDS[problem.kind].title)


def local(target: str) -> str:
    """An address of this service to go on to, whatever somebody wrote into a link."""
    # As browsers read it: without tabs and line ends, and a second slash of any kind begins the name of a host.
    read = re.sub(r"[\t\r\n]", "", target).replace("\\", "/")
    return target if read.startswith("/") and not read.startswith("//") else "/"
