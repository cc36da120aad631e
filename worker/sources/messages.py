"""Messages of RTSP 1.0 (RFC 2326), which look as those of HTTP do, and the packets of media between them.

Heads are read as browsers read them: lines without a name, spaces before the colon and bare line feeds are no reason to
show no picture.
"""

import asyncio
import re
from dataclasses import dataclass, replace
from urllib.parse import urlsplit

from worker.sources.errors import CameraError

LONGEST_HEAD = 64 * 1024
# Descriptions of streams (SDP) have some hundred bytes. FFmpeg makes a stream of every line that begins with m=.
LONGEST_BODY = 64 * 1024
PACKET = b"$"
NO_HEAD = "what it says is neither RTSP nor HTTP: its head has no end"


@dataclass(frozen=True)
class Message:
    """A request or a response: its first line, its headers in their order, its body."""

    first: str
    headers: tuple[tuple[str, str], ...] = ()
    body: bytes = b""

    @property
    def is_response(self) -> bool:
        """True for a response, False for a request."""
        return self.first.startswith("RTSP/")

    @property
    def status(self) -> int:
        """The status of a response."""
        word = (self.first.split(maxsplit=2) + ["", ""])[1]
        if not re.fullmatch("[1-9][0-9]{2}", word):
            raise CameraError("what it says is neither RTSP nor HTTP")
        return int(word)

    @property
    def length(self) -> int | None:
        """The `Content-Length`; None: it has none."""
        text = (self.all("Content-Length") or [""])[-1]
        if not text:
            return None
        # Python reads no number of thousands of digits, and one of 13 is beyond all pictures.
        if not re.fullmatch("0*[0-9]{1,12}", text):
            raise CameraError("it announces a Content-Length that is no number of bytes")
        return int(text.lstrip("0") or "0")

    @property
    def method(self) -> str:
        """The method of a request."""
        return self.first.split(maxsplit=1)[0] if self.first else ""

    def all(self, name: str) -> list[str]:
        """The values of a header."""
        return [value for key, value in self.headers if key.lower() == name.lower()]

    def having(self, name: str, value: str) -> "Message":
        """Return the message with one header of this name."""
        others = [(key, kept) for key, kept in self.headers if key.lower() != name.lower()]
        return replace(self, headers=(*others, (name, value)))

    def encoded(self) -> bytes:
        """Return the bytes of the message."""
        lines = [self.first, *(f"{name}: {value}" for name, value in self.headers), "", ""]
        return "\r\n".join(lines).encode("utf-8", "surrogateescape") + self.body


async def read(stream: asyncio.StreamReader) -> Message | bytes | None:
    """Read the next message of RTSP, or the bytes of a packet as they came; None at the end. Raises `CameraError`."""
    try:
        while (begin := await stream.readexactly(1)) in b"\r\n":
            pass
        if begin == PACKET:
            head = await stream.readexactly(3)
            return begin + head + await stream.readexactly(int.from_bytes(head[1:]))
        message = await read_head(stream, begin)
        if message.first.startswith("HTTP/"):
            raise CameraError("it speaks HTTP at this address: let the source begin with http:// or https://")
        if not re.search(r"^RTSP/\d|RTSP/\d\.\d$", message.first):
            raise CameraError("what it says is not RTSP")
        length = message.length or 0
        if length > LONGEST_BODY:
            raise CameraError(f"what it says has {length} bytes, more than {LONGEST_BODY}, so it is not RTSP")
        body = await stream.readexactly(length)
    except asyncio.IncompleteReadError:
        return None
    # Whoever reads it next must find the same end.
    return replace(message.having("Content-Length", str(length)) if length else message, body=body)


async def read_head(stream: asyncio.StreamReader, begin: bytes = b"") -> Message:
    """Read a message up to the empty line before its body. Raises `CameraError` and `asyncio.IncompleteReadError`."""
    lines: list[str] = []
    size = 0
    while True:
        try:
            line = begin + await stream.readuntil(b"\n")
        except asyncio.LimitOverrunError:
            raise CameraError(NO_HEAD) from None
        begin = b""
        size += len(line)
        if size > LONGEST_HEAD:
            raise CameraError(NO_HEAD)
        text = line.decode("utf-8", "surrogateescape").rstrip("\r\n")
        if text:
            lines.append(text)
        elif lines:
            break
    split = (line.partition(":") for line in lines[1:])
    return Message(lines[0], tuple((name.strip(), value.strip()) for name, _, value in split))


def redirect_in_words(message: Message, said: str) -> str:
    """Return what to say of a redirect: the host that it leads to, and nothing of the address that may be a secret."""
    try:
        parts = urlsplit("".join(message.all("Location")))
        host = f"[{parts.hostname}]" if ":" in (parts.hostname or "") else parts.hostname
        port = "" if parts.port is None else f":{parts.port}"
    except ValueError:
        host, port = None, ""
    place = f"{parts.scheme}://{host}{port}" if host and f"{parts.scheme}{host}".isprintable() else "another address"
    return f"{said} to {place[:200]}, which is not followed; give the address that it leads to"
