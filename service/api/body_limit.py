"""Limits of the size of request bodies, and refusal of compressed ones.

Files of a form are spooled to disk as they come. Any other body is held in memory, and parsed while everybody else
waits: it may have a megabyte, which is more than a document needs. FastAPI's own limit answers a too large
Content-Length in plain text, around every handler.
"""

from http import HTTPStatus

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import problem_response
from service.schemas.problems import Problem

LARGEST_DOCUMENT = 1_000_000


class BodyLimit:
    """ASGI middleware; `largest_form` in bytes."""

    def __init__(self, app: ASGIApp, largest_form: int) -> None:
        self._app = app
        self._largest_form = largest_form

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a body that says its size before it is read, and any other once it has grown too large."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if headers.get("content-encoding", "identity").lower() != "identity":
            # A few bytes can be gigabytes, and frames do not shrink by it anyway.
            packed = Problem("encoded-body", "Send it as it is.", headers={"Accept-Encoding": "identity"})
            await problem_response(packed)(scope, receive, send)
            return
        largest, too_large = self._limit(Request(scope))
        announced = headers.get("content-length", "0")
        if announced.isdecimal() and int(announced[:20]) > largest:
            await problem_response(Problem("body-too-large", too_large))(scope, receive, send)
            return
        arrived = 0

        async def counted() -> Message:
            nonlocal arrived
            message = await receive()
            arrived += len(message.get("body", b""))
            if arrived > largest:
                # The one exception that FastAPI's reading of a body lets through.
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, too_large)
            return message

        await self._app(scope, counted, send)

    def _limit(self, request: Request) -> tuple[int, str]:
        """Return how many bytes a body may have, and what to do about a larger one."""
        if is_form(request):
            return self._largest_form, f"{self._largest_form} bytes are allowed; send fewer or smaller frames."
        largest = min(LARGEST_DOCUMENT, self._largest_form)
        return largest, f"{largest} bytes are allowed of what is not multipart/form-data."


def is_form(request: Request) -> bool:
    """True if the body of a request is a form with files."""
    return request.headers.get("content-type", "").lower().startswith("multipart/form-data")
