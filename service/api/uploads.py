"""Limits of the number and size of uploads that arrive at once, on the disk and in memory."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from fastapi import Request
from starlette.datastructures import UploadFile

from service.observability.disk import spool_folder, spool_free_bytes
from service.schemas.problems import Problem
from service.settings import Settings

# Other uploads take seconds.
AGAIN = {"Retry-After": "5"}
# Frames of all uploads that are in memory at the same time, to be checked or stored; one is always let in.
IN_MEMORY_BYTES = 150_000_000
# Longer than a store that is away takes to say so.
PATIENCE_S = 15.0


class Uploads:
    """Uploads that arrive at one API process now."""

    def __init__(self, settings: Settings) -> None:
        self._at_once = settings.uploads_at_once
        self._most = int(settings.uploads_mb * 1e6)
        self._largest = int(settings.max_body_mb * 1e6)
        # Announced size of each, in bytes.
        self._announced: list[int] = []
        self._room = IN_MEMORY_BYTES
        self._room_changed = threading.Condition()

    @contextmanager
    def admitted(self, request: Request) -> Iterator[None]:
        """Admit an upload, or raise a problem before it is read. To be called in the event loop."""
        if len(self._announced) >= self._at_once:
            raise Problem(
                "unavailable",
                f"{self._at_once} uploads are arriving already, and more may not at once (ESC_UPLOADS_AT_ONCE).",
                headers=AGAIN,
            )
        announced = request.headers.get("content-length", "")
        size = int(announced) if announced.isdecimal() else self._largest
        if self._announced and size + sum(self._announced) > self._most:
            raise Problem(
                "unavailable",
                f"Uploads of {sum(self._announced) / 1e6:.0f} MB are arriving already; this one would make them more "
                f"than {self._most / 1e6:.0f} MB (ESC_UPLOADS_MB).",
                headers=AGAIN,
            )
        # Part of the other uploads is written already: counted twice rather than not at all.
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

    @contextmanager
    def content(self, upload: UploadFile) -> Iterator[bytes]:
        """Yield the bytes of one file, once there is room for them in memory. To be called in a thread.

        The caller must drop them at the end of the block.
        """
        size = min(upload.size or 0, IN_MEMORY_BYTES)
        with self._room_changed:
            if not self._room_changed.wait_for(lambda: self._room >= size, PATIENCE_S):
                raise Problem("unavailable", "The frames of other uploads are being stored.", headers=AGAIN)
            self._room -= size
        try:
            upload.file.seek(0)
            yield upload.file.read()
        finally:
            with self._room_changed:
                self._room += size
                self._room_changed.notify_all()
