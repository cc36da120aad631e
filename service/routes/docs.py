"""API documentation in a browser, from files of the package: it needs no internet."""

from pathlib import Path

from fastapi import APIRouter, Response
from starlette.responses import FileResponse, HTMLResponse

from service.api.context import InContext
from service.api.root_path import with_root_path
from service.routes.contract.documented import FOR_ALL
from service.routes.contract.guarded import Guarded

router = APIRouter(prefix="/docs", route_class=Guarded, include_in_schema=False)

FILES = Path(__file__).parent.parent / "apidocs"
# RapiDoc styles its elements in place.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@router.get("", openapi_extra=FOR_ALL)
async def page(context: InContext) -> Response:
    """Return the page; where the service asks for no keys, it does not mention any."""
    text = (FILES / "index.html").read_text(encoding="utf-8")
    if not await context.authenticator.asks_for_keys():
        text = text.replace('allow-authentication="true"', 'allow-authentication="false"')
    return HTMLResponse(with_root_path(text, context.settings.root_path), headers={"Content-Security-Policy": POLICY})


def _serve(name: str, media_type: str) -> None:
    async def file() -> FileResponse:
        return FileResponse(FILES / name, media_type=media_type)

    router.add_api_route(f"/{name}", file, name=name, openapi_extra=FOR_ALL)


# RapiDoc 9.3.8, which draws the page, its licence, and what tells it whether the browser prefers dark colours.
_serve("rapidoc-min.js", "text/javascript")
_serve("LICENSE.txt", "text/plain")
_serve("scheme.js", "text/javascript")
