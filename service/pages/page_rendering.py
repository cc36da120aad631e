"""Rendering of pages from templates, with a strict Content-Security-Policy and problems as pages."""

import hashlib
import re
from collections.abc import Callable, Coroutine
from http import HTTPStatus
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any
from urllib.parse import quote

import structlog
from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.responses import HTMLResponse, RedirectResponse

from service.api.auth import COOKIE, missing_scope, page_token
from service.api.problems import unreadable_problem
from service.api.root_path import with_root_path
from service.pages import formatting
from service.pages.assets import address
from service.pages.seam import is_within_uncertainty, seam_curve
from service.pages.trend_charts import trend_charts
from service.routes.contract.guarded import Guarded
from service.schemas.problems import PROBLEM_TYPES, REFUSAL_REASONS, Problem
from service.store.database import DATABASE_OUTAGES
from service.store.keys import Key
from service.store.unreadable import UnreadableRow

SIGN_IN = "/ui/sign-in"
# Scripts, styles and pictures are files of this service; nothing inline, and no framing by other sites.
POLICY = "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "same-origin",
    # Pages show current numbers, and must not stay in the browser after signing out.
    "Cache-Control": "no-store",
}
log = structlog.get_logger()
# `3 min ago` changes by itself, and is no change of a page.
TIME = re.compile(r"(<time\b[^>]*>)[^<]*")


def part_version(part: str) -> str:
    """Return a hash of a part of a page without its relative times."""
    return hashlib.blake2s(TIME.sub(r"\1", part).encode(), digest_size=8).hexdigest()


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
    "is_within_uncertainty": is_within_uncertainty,
    "seam_curve": seam_curve,
    "reasons": REFUSAL_REASONS,
    "alarm_words": formatting.ALARMS,
    "kind_words": formatting.KINDS,
    # The extra `exr`, without which the service answers each ST map with 503.
    "makes_st_maps": find_spec("OpenEXR") is not None,
}
templates.filters |= {
    "figure": formatting.figure,
    "for_people": formatting.for_people,
    "cm": formatting.centimetres,
    "on_the_pitch": formatting.on_the_pitch,
    "degrees": formatting.degrees,
    "percent": formatting.percent,
    "probability": formatting.probability,
    "longer": formatting.length_change,
    "capitalised": formatting.capitalised,
    "ago": formatting.ago,
    "moment": formatting.moment,
    "seconds": formatting.seconds,
    "edition": part_version,
    "trend_charts": trend_charts,
}


class Page(Guarded):
    """A route that answers with a page, also for errors; clients without a session are redirected to the sign-in."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler that turns errors into pages."""
        handle = super().get_route_handler()

        async def shown(request: Request) -> Response:
            try:
                return await handle(request)
            except Problem as problem:
                return problem_page(request, problem)
            except UnreadableRow as error:
                return problem_page(request, unreadable_problem(error))
            except RequestValidationError:
                return problem_page(request, Problem("not-found", "The address is not one of this service's."))
            except DATABASE_OUTAGES:
                log.warning("cannot show a page", exc_info=True)
                return problem_page(
                    request, Problem("unavailable", "Its storage does not answer. Try again in a moment.")
                )

        return shown


def render_page(request: Request, template: str, status: int = 200, **content: Any) -> Response:
    """Render a template into an answer."""
    key: Key | None = getattr(request.state, "key", None)
    token = request.cookies.get(COOKIE)
    root_path = request.app.state.context.settings.root_path
    text = templates.get_template(template).render(
        root_path=root_path,
        key=key,
        token=page_token(token) if key and token else "",
        may=lambda scope: missing_scope(key, scope) is None,
        path=request.url.path,
        **content,
    )
    return HTMLResponse(with_root_path(text, root_path), status, HEADERS)


def problem_page(request: Request, problem: Problem) -> Response:
    """Return the page of a problem, or a redirect to the sign-in."""
    status = PROBLEM_TYPES[problem.kind].status
    if status == HTTPStatus.UNAUTHORIZED:
        wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        return RedirectResponse(f"{SIGN_IN}?next={quote(wanted)}", HTTPStatus.SEE_OTHER)
    return render_page(request, "problem.html", status, problem=problem, title=PROBLEM_TYPES[problem.kind].title)


def local_target(target: str) -> str:
    """Return a redirect target if it is a path of this service, else `/`: links may be forged (open redirects)."""
    # Browsers drop tabs and line ends, and take two slashes or backslashes for the beginning of a host name.
    parsed = re.sub(r"[\t\r\n]", "", target).replace("\\", "/")
    return target if parsed.startswith("/") and not parsed.startswith("//") else "/"
