"""Uploads while they arrive: how many at once, and whether there is room where they are spooled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from starlette.requests import Request

from service.observe.disk import spool_folder, spool_free_bytes
from service.settings import Settings
from service.wire.problems import Problem

# Other uploads take seconds.
AGAIN_S = 5


class Uploads:
    """Those that one API process takes at the moment. To be asked in its event loop."""

    def __init__(self, settings: Settings) -> None:
        self._at_once = settings.uploads_at_once
        self._largest = int(settings.max_body_mb * 1e6)
        # What each of them may still bring.
        self._announced: list[int] = []

    @contextmanager
    def admitted(self, request: Request) -> Iterator[None]:
        """Let an upload in, or refuse it before it is read."""
        if len(self._announced) >= self._at_once:
            raise Problem(
                "unavailable",
                f"{self._at_once} uploads are arriving already, and more may not at once (ESC_UPLOADS_AT_ONCE).",
                headers={"Retry-After": str(AGAIN_S)},
            )
        announced = request.headers.get("content-length", "")
        size = int(announced) if announced.isdecimal() else self._largest
        # Of the others, part has been written: counted twice rather than not at all.
        if spool_free_bytes() < size + sum(self._announced):
            raise Problem(
                "disk-full",
                f"There is no room for {size / 1e6:.0f} MB in {spool_folder()}, where uploads are kept while they "
                "arrive. Free some, or set TMPDIR to a larger place.",
            )
        self._announced.append(size)
        try:
            yield
        finally:
            self._announced.remove(size)
