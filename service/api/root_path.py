"""Service below a path of another site, such as https://truck.example.com/esc/.

The routes do not know the path. Addresses in JSON are relative to the address of the service, whatever that is: they
are the same for every process and in every webhook, and are appended to the URL that a client was given.
"""

import re
from urllib.parse import urlsplit, urlunsplit

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Attributes of our pages that hold addresses. What others wrote cannot look like one: its quotes are escaped.
ADDRESS = re.compile(
    r'(\b(?:href|src|action|spec-url|data-(?:address|call|curves|events|follows|history|reports|seam|then))=")(?=/(?!/))'
)


def with_root_path(html: str, root_path: str) -> str:
    """Return a page with the root path in front of all addresses of this service."""
    return ADDRESS.sub(rf"\g<1>{root_path}", html) if root_path else html


class RootPath:
    """ASGI middleware, around all others: takes the root path off requests, and puts it into `Location`.

    A `Location` is made relative to the host: which one the client names is his word, not an address of the service.
    """

    def __init__(self, app: ASGIApp, root_path: str) -> None:
        """`root_path`: empty, or begins with a slash and ends without one."""
        self._app = app
        self._root_path = root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if target := headers.get("location"):
                    headers["location"] = self._root_path + _without_host(target)
            await send(message)

        await self._app(self._below(scope), receive, answer)

    def _below(self, scope: Scope) -> Scope:
        path: str = scope["path"]
        if not self._root_path:
            return scope
        if path != self._root_path and not path.startswith(f"{self._root_path}/"):
            return scope
        raw_path: bytes = scope["raw_path"]
        return {
            **scope,
            "path": path.removeprefix(self._root_path) or "/",
            "raw_path": raw_path.removeprefix(self._root_path.encode("ascii")) or b"/",
        }


def _without_host(url: str) -> str:
    """Return a URL of this service as its routes know it, such as Starlette's absolute one without a last slash."""
    parts = urlsplit(url)
    # A path that begins with two slashes would name a host.
    return urlunsplit(("", "", "/" + parts.path.lstrip("/"), parts.query, parts.fragment))
