"""Responses with entity tags: clients that have the content get 304 without it."""

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Header, Response
from pydantic import BaseModel

from service.routes.contract.documented import header_docs
from service.schemas import etags

IfNoneMatch = Annotated[
    str | None, Header(description="`ETag` of the answer that the client has: 304 if it is the same.")
]
# Entries for `responses=`.
TAGGED: dict[int | str, dict[str, Any]] = {
    200: header_docs("ETag"),
    304: {"description": "Unchanged", **header_docs("ETag")},
}


def tagged_response(
    made_of: bytes, if_none_match: str | None, whole: Callable[[], Response], kept: str = "no-cache"
) -> Response:
    """Return the `whole` response, or 304. `made_of`: its content or sources; `kept`: its `Cache-Control`."""
    answer = Response(status_code=304) if is_known(made_of, if_none_match) else whole()
    answer.headers.update({"ETag": etags.quoted(etags.of(made_of)), "Cache-Control": kept})
    return answer


def is_known(made_of: bytes, if_none_match: str | None) -> bool:
    """True if the client has the content already."""
    return if_none_match is not None and etags.matches(if_none_match, etags.of(made_of), weakly=True)


def tagged_json(content: BaseModel, if_none_match: str | None, status: int = 200) -> Response:
    """Return content as JSON, or 304."""
    body = content.model_dump_json().encode()
    return tagged_response(body, if_none_match, lambda: Response(body, status, media_type="application/json"))
