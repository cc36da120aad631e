"""Motion JPEG over HTTP: `multipart/x-mixed-replace`, an endless row of pictures of which the first is taken."""

from __future__ import annotations

import re

# Of the headers of a part, and of what may stand before the first one.
LONGEST_HEAD = 16 * 1024
HEAD = re.compile(rb"(?:^|\r?\n)(--[^\r\n]+)\r?\n((?:[^\r\n]+\r?\n)*)\r?\n")
LENGTH = re.compile(rb"^content-length:[ \t]*(\d{1,12})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)


class NotMultipartError(Exception):
    """What comes is not divided into parts."""


class FirstPart:
    """Finds the first part of a body that comes in pieces.

    The line between two parts is taken as it comes: cameras disagree with their own `boundary`, by two dashes mostly.
    """

    def __init__(self) -> None:
        self._came = bytearray()
        self._begin = 0
        self._end: int | None = None
        self._delimiter = b""
        self._searched = 0

    def feed(self, piece: bytes) -> bytes | None:
        """Take the next piece of the body; returns the first part that is not empty once it is whole."""
        self._came += piece
        while self._delimiter or self._has_begun():
            end = self._where_it_ends()
            if end is None:
                return None
            if end > self._begin:
                return bytes(self._came[self._begin : end])
            del self._came[:end]
            self._delimiter = b""
        return None

    def _has_begun(self) -> bool:
        found = HEAD.search(self._came)
        if found is None:
            if len(self._came) > LONGEST_HEAD:
                raise NotMultipartError
            return False
        self._delimiter, self._begin, self._searched = found[1], found.end(), found.end()
        length = LENGTH.search(found[2])
        self._end = None if length is None or int(length[1]) == 0 else found.end() + int(length[1])
        return True

    def _where_it_ends(self) -> int | None:
        if self._end is not None:
            return self._end if len(self._came) >= self._end else None
        # The line end before the delimiter belongs to it.
        found = self._came.find(
            b"\n" + self._delimiter, max(self._begin - 1, self._searched - len(self._delimiter) - 1)
        )
        self._searched = len(self._came)
        if found < 0:
            return None
        line_end = found - 1 if self._came[found - 1 : found] == b"\r" else found
        return max(self._begin, line_end)
