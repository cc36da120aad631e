"""Messages of RTSP 1.0 (RFC 2326): requests, responses, and the packets of media between them."""

from __future__ import annotations

import asyncio
import re
from dataclasses import dataclass, replace

LONGEST_HEAD = 64 * 1024
LONGEST_BODY = 1024 * 1024
PACKET = b"$"


class NotRtspError(Exception):
    """What comes is no message of RTSP, or one that is too long."""


@dataclass(frozen=True)
class RtspMessage:
    """A request or a response: its first line, its headers in their order, its body."""

    first: str
    headers: tuple[tuple[str, str], ...] = ()
    body: bytes = b""

    @property
    def is_response(self) -> bool:
        """Whether it is a response."""
        return self.first.startswith("RTSP/")

    @property
    def status(self) -> int:
        """The status of a response."""
        word = (self.first.split(maxsplit=2) + ["", ""])[1]
        if not (word.isascii() and word.isdecimal()):
            raise NotRtspError
        return int(word)

    @property
    def method(self) -> str:
        """The method of a request."""
        return self.first.split(maxsplit=1)[0] if self.first else ""

    def all(self, name: str) -> list[str]:
        """The values of a header."""
        return [value for its, value in self.headers if its.lower() == name.lower()]

    def having(self, name: str, value: str) -> RtspMessage:
        """Return the message with one header of this name."""
        others = [(its, kept) for its, kept in self.headers if its.lower() != name.lower()]
        return replace(self, headers=(*others, (name, value)))

    def encoded(self) -> bytes:
        """As it is sent."""
        lines = [self.first, *(f"{name}: {value}" for name, value in self.headers), "", ""]
        return "\r\n".join(lines).encode("utf-8", "surrogateescape") + self.body


async def read(stream: asyncio.StreamReader) -> RtspMessage | bytes | None:
    """Read the next message, or the bytes of a packet as they came; None at the end."""
    try:
        while (begin := await stream.readexactly(1)) in b"\r\n":
            pass
        if begin == PACKET:
            head = await stream.readexactly(3)
            return begin + head + await stream.readexactly(int.from_bytes(head[1:]))
        return await _message(begin, stream)
    except asyncio.IncompleteReadError:
        return None
    except asyncio.LimitOverrunError:
        raise NotRtspError from None


async def _message(begin: bytes, stream: asyncio.StreamReader) -> RtspMessage:
    lines: list[str] = []
    size = 0
    while True:
        line = begin + await stream.readuntil(b"\n")
        begin = b""
        size += len(line)
        if size > LONGEST_HEAD:
            raise NotRtspError
        text = line.decode("utf-8", "surrogateescape").rstrip("\r\n")
        if not text:
            break
        lines.append(text)
    if not re.search(r"^RTSP/\d|RTSP/\d\.\d$", lines[0]):
        raise NotRtspError
    split = (line.partition(":") for line in lines[1:])
    message = RtspMessage(lines[0], tuple((name.strip(), value.strip()) for name, _, value in split))
    length = (message.all("Content-Length") or ["0"])[-1]
    if not (length.isascii() and length.isdecimal()) or int(length[:9]) > LONGEST_BODY:
        raise NotRtspError
    return replace(message, body=await stream.readexactly(int(length)))
