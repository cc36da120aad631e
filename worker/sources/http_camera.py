"""A picture of a camera that speaks HTTP, read as browsers read it.

By a reader of its own: httpx refuses what the firmware of cameras writes into heads, which browsers and curl pass over.
Nothing of a camera's answer is followed: a redirect is refused with where it leads.
"""

import asyncio
import http.client
import mimetypes
import re
import zlib
from collections.abc import AsyncIterator, Sequence
from importlib.metadata import version

import httpx

from worker.sources.authorization import Authorization, denied
from worker.sources.connection import connect
from worker.sources.errors import CameraError
from worker.sources.messages import Message, read_head, redirect_in_words
from worker.sources.pictures import FirstPicture

PIECE = 64 * 1024
# A camera that announces too few bytes sends the others at once; one that keeps the connection sends no more.
MORE_S = 1.0
MEDIA_TYPE = re.compile(r"[a-z0-9.+-]{1,40}/[a-z0-9.+-]{1,40}", re.IGNORECASE)
WEB_PAGE = re.compile(rb"\s*(?:<!doctype html|<html)", re.IGNORECASE)
# What a picture may call itself; other names are told of where there is none.
OF_PICTURES = ("image/", "application/octet-stream", "binary/")


async def fetch_picture(target: httpx.URL, addresses: Sequence[str], userinfo: str | None, most_bytes: int) -> bytes:
    """Return the first whole JPEG or PNG of a camera, or what it sent in place of one. Raises `CameraError`.

    `target`: the camera's URL without user and password; `addresses`: where its host is, checked; `userinfo`: as it
    stands in a URL, or None.
    """
    authorization = Authorization(userinfo)
    tried: list[str] = []
    while True:
        stream, writer = await connect(target, addresses)
        try:
            uri = target.raw_path.decode("ascii")
            writer.write(_request(target, uri, authorization.header("GET", uri)))
            head = await _read_head(stream)
            way = authorization.choose(head.all("WWW-Authenticate"), tried) if head.status == 401 else None
            if way is None:
                return await _picture(head, stream, most_bytes)
            tried.append(way)
        except asyncio.IncompleteReadError:
            raise CameraError("it closed the connection without an answer; do others look at it already?") from None
        except OSError as error:
            raise CameraError(f"the connection broke off: {error.strerror or error}") from None
        finally:
            # At once: an orderly end of TLS waits for the camera.
            writer.transport.abort()


def _request(target: httpx.URL, uri: str, signature: str | None) -> bytes:
    lines = [
        f"GET {uri} HTTP/1.1",
        f"Host: {target.netloc.decode('ascii')}",
        f"User-Agent: esc/{version('esc-calibration')}",
        "Accept: */*",
        "Accept-Encoding: identity",
        "Connection: close",
        *([] if signature is None else [f"Authorization: {signature}"]),
    ]
    return "\r\n".join([*lines, "", ""]).encode("utf-8", "surrogateescape")


async def _read_head(stream: asyncio.StreamReader) -> Message:
    """Read the head of the answer, past those that only say that one follows (1xx)."""
    while True:
        head = await read_head(stream)
        if head.first.startswith("RTSP/"):
            raise CameraError("it speaks RTSP at this address: let the source begin with rtsp://")
        if head.status >= 200:
            return head


async def _picture(head: Message, stream: asyncio.StreamReader, most_bytes: int) -> bytes:
    _check_status(head)
    first, size = FirstPicture(), 0
    async for piece in _body(head, stream):
        size += len(piece)
        if size > most_bytes:
            raise CameraError(f"it has more than the {most_bytes / 1e6:g} MB of ESC_MAX_FRAME_MB")
        picture = first.feed(piece)
        if picture is not None:
            return picture
    return _without_picture(head, bytes(first.data))


def _check_status(head: Message) -> None:
    if head.status in (401, 403):
        raise CameraError(denied(head.status, head.all("WWW-Authenticate")))
    if 300 <= head.status < 400:
        raise CameraError(redirect_in_words(head, f"it answered {head.status} and leads"))
    if head.status != 200:
        # The words beside the status are the host's, which may be anybody's: those of the standard are told instead.
        raise CameraError(f"it answered {head.status} {http.client.responses.get(head.status, '')}".rstrip())


def _without_picture(head: Message, data: bytes) -> bytes:
    """Return what came in place of a whole JPEG or PNG, which others judge; raises `CameraError` for a text."""
    found = MEDIA_TYPE.match("".join(head.all("Content-Type")[:1]))
    kind = "" if found is None else found[0].lower()
    if kind == "text/html" or WEB_PAGE.match(data):
        raise CameraError(
            "it answered with a web page in place of a picture: does it want a login, or is this the address of its "
            "page? Give the address of the picture itself"
        )
    if kind.startswith("multipart/"):
        raise CameraError("it is a row of pictures (multipart) that ended before the first was whole")
    if kind and not kind.startswith(OF_PICTURES):
        known = kind if mimetypes.guess_extension(kind) else "something else"
        raise CameraError(f"it answered with {known}, not with a picture")
    if "chunked" not in "".join(head.all("Transfer-Encoding")).lower() and len(data) < (head.length or 0):
        raise CameraError(f"it ended after {len(data)} of the {head.length} bytes that it announced")
    return data


async def _body(head: Message, stream: asyncio.StreamReader) -> AsyncIterator[bytes]:
    is_chunked = "chunked" in "".join(head.all("Transfer-Encoding")).lower()
    pieces = _chunks(stream) if is_chunked else _pieces(stream, head.length)
    if not re.search("gzip|deflate", "".join(head.all("Content-Encoding")), re.IGNORECASE):
        async for piece in pieces:
            yield piece
        return
    # zlib reads either of the two.
    decoder = zlib.decompressobj(wbits=zlib.MAX_WBITS | 32)
    try:
        async for piece in pieces:
            while piece:
                yield decoder.decompress(piece, PIECE)
                piece = decoder.unconsumed_tail
    except zlib.error as error:
        raise CameraError(f"what it sent compressed cannot be read: {error}") from None


async def _pieces(stream: asyncio.StreamReader, length: int | None) -> AsyncIterator[bytes]:
    """Yield what comes until the camera closes, or sends no more than it announced."""
    came = 0
    while True:
        limit_s = None if length is None or came < length else MORE_S
        try:
            piece = await asyncio.wait_for(stream.read(PIECE), limit_s)
        except TimeoutError:
            return
        if not piece:
            return
        came += len(piece)
        yield piece


async def _chunks(stream: asyncio.StreamReader) -> AsyncIterator[bytes]:
    try:
        while remaining := _chunk_size(await stream.readuntil(b"\n")):
            while remaining:
                piece = await stream.read(min(remaining, PIECE))
                if not piece:
                    return
                remaining -= len(piece)
                yield piece
            await stream.readuntil(b"\n")
    except asyncio.IncompleteReadError:
        return
    except asyncio.LimitOverrunError:
        raise CameraError("its answer is announced in chunks and has none") from None


def _chunk_size(line: bytes) -> int:
    size = line.partition(b";")[0].strip()
    if not re.fullmatch(rb"0*[0-9a-f]{1,12}", size, re.IGNORECASE):
        raise CameraError("its answer is announced in chunks and has none")
    return int(size, 16)
