"""No request is larger than the setting says, nor packed; the answer to one that is, is a problem like every other.

FastAPI's own limit answers a too large Content-Length in plain text, around every handler.
"""

from __future__ import annotations

from http import HTTPStatus

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import answer
from service.wire.problems import Problem


class BodyLimit:
    """ASGI middleware; `largest` in bytes."""

    def __init__(self, app: ASGIApp, largest: int) -> None:
        self._app = app
        self._largest = largest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a body that says its size before it is read, and any other once it has grown too large."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if headers.get("content-encoding", "identity").lower() != "identity":
            # A few bytes can be gigabytes, and frames do not shrink by it anyway.
            packed = Problem("encoded-body", "Send it as it is.", headers={"Accept-Encoding": "identity"})
            await answer(packed)(scope, receive, send)
            return
        announced = headers.get("content-length", "0")
        if announced.isdecimal() and int(announced[:20]) > self._largest:
            refusal = Problem("body-too-large", f"{self._largest} bytes are allowed; send fewer or smaller frames.")
            await answer(refusal)(scope, receive, send)
            return
        arrived = 0

        async def counted() -> Message:
            nonlocal arrived
            message = await receive()
            arrived += len(message.get("body", b""))
            if arrived > self._largest:
                # The one exception that FastAPI's reading of a body lets through.
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return message

        await self._app(scope, counted, send)
