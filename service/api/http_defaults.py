"""HEAD for every address (RFC 9110, section 9.3.2), and headers that keep browsers from guessing types."""

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Neither read as another type than it has, nor embedded by pages of other origins.
FOR_BROWSERS = {"X-Content-Type-Options": "nosniff", "Cross-Origin-Resource-Policy": "same-origin"}


class HttpDefaults:
    """ASGI middleware: answers HEAD as GET without a body, and adds headers for browsers."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        only_head = scope["method"] == "HEAD"

        async def answer(message: Message) -> None:
            begins = message["type"] == "http.response.start"
            if begins:
                MutableHeaders(scope=message).update(FOR_BROWSERS)
            if begins or not only_head:
                await send(message)
            if begins and only_head:
                # Nobody reads on: streams, which would go on until the client hangs up, hear that it has.
                await send({"type": "http.response.body"})

        await self._app({**scope, "method": "GET"} if only_head else scope, receive, answer)
