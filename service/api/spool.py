"""Spool of an upload: one temporary file for all files of a form.

Starlette keeps each file below 1 MB in memory, and opens a descriptor for each of the others. A form of many frames
just below that size is hundreds of megabytes, and one of 150 larger ones is 150 descriptors. Files of a form come one
after the other, so that each is a part of one file.
"""

import io
import tempfile
from typing import BinaryIO, Self, cast

from fastapi import Request
from starlette.datastructures import FormData
from starlette.formparsers import MultiPartException, MultiPartParser

from service.schemas.problems import Problem


class Spool:
    """Temporary file that the files of a form are appended to; it is deleted at the end of its block."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115  (closed by __exit__)
        self._size = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    @property
    def size(self) -> int:
        """Number of bytes written."""
        return self._size

    def append(self, data: bytes) -> None:
        """Write at the end."""
        self._file.seek(self._size)
        self._file.write(data)
        self._size += len(data)

    def read(self, start: int, length: int) -> bytes:
        """Read a part."""
        self._file.seek(start)
        return self._file.read(length)


class SpooledFile:
    """File of a form for `UploadFile`, a part of a spool: written to its end, then read."""

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._start = spool.size
        self._length = 0
        self._position = 0

    def write(self, data: bytes) -> int:
        """Append bytes."""
        if not self._length:
            self._start = self._spool.size
        assert self._start + self._length == self._spool.size, "files of a form come one after the other"
        self._spool.append(data)
        self._length += len(data)
        return len(data)

    def read(self, size: int = -1) -> bytes:
        """Return up to `size` bytes from where the last read ended; -1: all of the rest."""
        rest = self._length - self._position
        data = self._spool.read(self._start + self._position, rest if size < 0 else min(size, rest))
        self._position += len(data)
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set where the next read begins."""
        origin = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: self._length}[whence]
        self._position = min(max(0, origin + offset), self._length)
        return self._position

    def close(self) -> None:
        """Do nothing: the spool is closed by its own block."""


class _Parser(MultiPartParser):
    """Starlette's parser of forms, whose files go to a spool."""

    spool: Spool

    def on_headers_finished(self) -> None:
        """Begin a part."""
        super().on_headers_finished()
        if self._current_part.file is not None:
            # The one that Starlette has just made.
            self._files_to_close_on_error.pop().close()
            self._current_part.file.file = cast(BinaryIO, SpooledFile(self.spool))


async def parsed_form(request: Request, spool: Spool, max_files: int, max_fields: int, max_part_size: int) -> FormData:
    """Read the form of a request. Its files can be read while the spool is open."""
    stream = request.stream()
    parser = _Parser(request.headers, stream, max_files=max_files, max_fields=max_fields, max_part_size=max_part_size)
    parser.spool = spool
    try:
        return await parser.parse()
    except MultiPartException as error:
        raise Problem("malformed-request", error.message) from None
    finally:
        await stream.aclose()
