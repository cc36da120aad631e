"""Static files of the page, under addresses that change with their content: a browser keeps them for a year."""

from __future__ import annotations

import hashlib
import mimetypes
from functools import cache
from pathlib import Path

from fastapi import APIRouter, Response

from service.routes.contract.documented import FOR_ALL
from service.routes.contract.guarded import Guarded
from service.routes.contract.tagged import IfNoneMatch, tagged_response
from service.schemas.problems import Problem

FILES = Path(__file__).parent / "static"
FOR_A_YEAR = "public, max-age=31536000, immutable"
router = APIRouter(prefix="/ui/static", route_class=Guarded, include_in_schema=False)
at_the_root = APIRouter(route_class=Guarded, include_in_schema=False)


@cache
def contents() -> dict[str, bytes]:
    """Every file by its path."""
    paths = sorted(path for path in FILES.rglob("*") if path.is_file())
    return {path.relative_to(FILES).as_posix(): path.read_bytes() for path in paths}


@cache
def files_version() -> str:
    """A name of all files as they are: scripts import each other by relative addresses, so one name is for all."""
    together = hashlib.sha256()
    for path, content in contents().items():
        together.update(path.encode() + b"\0" + hashlib.sha256(content).digest())
    return together.hexdigest()[:16]


def address(path: str) -> str:
    """Where a file is."""
    if path not in contents():
        raise KeyError(path)
    return f"/ui/static/{files_version()}/{path}"


@at_the_root.get("/favicon.ico", openapi_extra=FOR_ALL)
async def favicon() -> Response:
    """The sign of the service, where browsers look for one that a page does not name: that is an SVG as well."""
    return Response(
        contents()["icon.svg"], media_type="image/svg+xml", headers={"Cache-Control": "public, max-age=86400"}
    )


@router.get("/{of_edition}/{path:path}", openapi_extra=FOR_ALL)
async def static_file(of_edition: str, path: str, if_none_match: IfNoneMatch = None) -> Response:
    """A file; a page that was loaded before an update gets the new one, and does not keep it."""
    content = contents().get(path)
    if content is None:
        raise Problem("not-found", f"The page has no file {path[:200]}; load it again.")
    media_type = mimetypes.guess_type(path)[0] or "application/octet-stream"
    kept = FOR_A_YEAR if of_edition == files_version() else "no-cache"
    return tagged_response(content, if_none_match, lambda: Response(content, media_type=media_type), kept)
