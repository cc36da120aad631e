"""Answers that name their content: whoever has it already is told so (304), and nothing is sent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Header, Response

from service.api import etags
from service.routes.contract.documented import header_docs

IfNoneMatch = Annotated[str | None, Header()]
# Of `responses=`.
TAGGED: dict[int | str, dict[str, Any]] = {
    200: header_docs("ETag"),
    304: {"description": "Unchanged", **header_docs("ETag")},
}


def tagged_response(
    made_of: bytes, if_none_match: str | None, whole: Callable[[], Response], kept: str = "no-cache"
) -> Response:
    """The whole answer, or 304. `made_of`: its content, or what that is computed from; `kept`: by whom, how long."""
    tag = etags.of(made_of)
    known = if_none_match is not None and etags.matches_weakly(if_none_match, tag)
    answer = Response(status_code=304) if known else whole()
    answer.headers.update({"ETag": etags.quoted(tag), "Cache-Control": kept})
    return answer


def json_response(body: bytes) -> Callable[[], Response]:
    """The whole of an answer that is written already."""
    return lambda: Response(body, media_type="application/json")
