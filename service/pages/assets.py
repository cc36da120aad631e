"""Static files of the pages, at addresses that change with their content: browsers cache them for a year."""

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
    """Return the content of every file by its path."""
    paths = sorted(path for path in FILES.rglob("*") if path.is_file())
    return {path.relative_to(FILES).as_posix(): path.read_bytes() for path in paths}


@cache
def files_version() -> str:
    """Return a hash of all files; one for all, since scripts import each other by relative addresses."""
    together = hashlib.sha256()
    for path, content in contents().items():
        together.update(path.encode() + b"\0" + hashlib.sha256(content).digest())
    return together.hexdigest()[:16]


def address(path: str) -> str:
    """Return the address of a file. Raises `KeyError` if there is none."""
    if path not in contents():
        raise KeyError(path)
    return f"/ui/static/{files_version()}/{path}"


@at_the_root.get("/favicon.ico", openapi_extra=FOR_ALL)
async def favicon() -> Response:
    """Answer the icon at the address that browsers try by default; it is an SVG."""
    return Response(
        contents()["icon.svg"], media_type="image/svg+xml", headers={"Cache-Control": "public, max-age=86400"}
    )


@router.get("/{version}/{path:path}", openapi_extra=FOR_ALL)
async def static_file(version: str, path: str, if_none_match: IfNoneMatch = None) -> Response:
    """Answer a file. A page that was loaded before an update gets the new file, and may not cache it."""
    content = contents().get(path)
    if content is None:
        raise Problem("not-found", f"The page has no file {path[:200]}; load it again.")
    media_type = mimetypes.guess_type(path)[0] or "application/octet-stream"
    caching = FOR_A_YEAR if version == files_version() else "no-cache"
    return tagged_response(content, if_none_match, lambda: Response(content, media_type=media_type), caching)
