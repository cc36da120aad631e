"""A relay on loopback between FFmpeg and a camera: FFmpeg knows no password and reaches no other host.

FFmpeg follows the redirects of a server of RTSP, and answers the host that they lead to with the password of the first.
A look ahead would not help: a camera may answer once and redirect later. So FFmpeg is given the address of this relay.
The relay connects to the address that was checked, signs the requests that the camera asks to have signed, and takes
any redirect for the end.
"""

from __future__ import annotations

import asyncio
import secrets
import ssl
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from urllib.parse import urlsplit

import httpx

from worker.sources.rtsp_authorization import Authorization
from worker.sources.rtsp_messages import LONGEST_HEAD, NotRtspError, RtspMessage, read

UNAUTHORIZED = 401
DENIED = (UNAUTHORIZED, 403)
STARTING_S = 10.0


@dataclass(frozen=True)
class _Sent:
    """A request as FFmpeg sent it, but for its URI, and how often it was sent on."""

    request: RtspMessage
    attempt: int


class Relay:
    """Relays one stream of a camera, from entering the `with` block to leaving it.

    `target`: the camera's URL without user and password; `addresses`: where its host is, checked; `userinfo`: as it
    stands in a URL, or None.
    """

    def __init__(self, target: httpx.URL, addresses: Sequence[str], port: int, userinfo: str | None) -> None:
        self._target = target
        self._addresses = addresses
        self._port = port
        self._authorization = None if userinfo is None else Authorization(userinfo)
        # Other users of this machine reach the port as well.
        self._token = secrets.token_urlsafe(16)
        self._loop = asyncio.new_event_loop()
        self._listening = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="rtsp-relay")
        self._here = ""
        self._why: str | None = None

    def __enter__(self) -> Relay:
        self._thread.start()
        if not self._listening.wait(STARTING_S):
            raise OSError("the relay of a stream did not start")
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(STARTING_S)

    @property
    def url(self) -> str:
        """The address of the camera's stream for FFmpeg."""
        return self._here + self._target.raw_path.decode("ascii")

    @property
    def why(self) -> str | None:
        """Why the camera gives no stream, in words; None: it did not say."""
        return self._why

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, "127.0.0.1", 0, limit=LONGEST_HEAD))
        self._here = f"rtsp://127.0.0.1:{server.sockets[0].getsockname()[1]}/{self._token}"
        self._listening.set()
        self._loop.run_forever()
        server.close()
        talks = asyncio.all_tasks(self._loop)
        for talk in talks:
            talk.cancel()
        self._loop.run_until_complete(asyncio.gather(*talks, return_exceptions=True))
        self._loop.close()

    async def _serve(self, player: asyncio.StreamReader, to_player: asyncio.StreamWriter) -> None:
        try:
            first = await read(player)
            if not isinstance(first, RtspMessage) or self._here not in first.first:
                return
            camera, to_camera = await self._connect()
            try:
                talk = _Talk(self, to_camera, to_player)
                await talk.ask(first)
                both = [asyncio.ensure_future(talk.requests(player)), asyncio.ensure_future(talk.responses(camera))]
                done, others = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
                for other in others:
                    other.cancel()
                for task in done:
                    task.result()
            finally:
                to_camera.close()
        except _Refused as refused:
            self._why = str(refused)
        except NotRtspError:
            self._why = "what it says is not RTSP"
        except asyncio.CancelledError:
            # The relay ends, and this with it; asyncio would report a server's task that ends so.
            pass
        except OSError as error:
            self._why = self._why or f"it cannot be reached: {error.strerror or error}"
        finally:
            to_player.close()

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        tls = _tls() if self._target.scheme == "rtsps" else None
        name = self._target.host if tls else None
        failed = OSError("it has no address")
        for address in self._addresses:
            try:
                return await asyncio.open_connection(
                    address, self._port, ssl=tls, server_hostname=name, limit=LONGEST_HEAD
                )
            except OSError as error:
                failed = error
        raise failed

    def meant(self, request: RtspMessage) -> RtspMessage:
        """The request with the camera's address in place of the relay's."""
        there = f"{self._target.scheme}://{self._target.netloc.decode('ascii')}"
        return replace(request, first=request.first.replace(self._here, there, 1))

    def signed(self, request: RtspMessage) -> str | None:
        """Return the credentials of a request, where the camera has asked for them."""
        words = request.first.split()
        if self._authorization is None or len(words) < 2:
            return None
        return self._authorization.header(words[0], words[1])

    def can_sign(self, asked: RtspMessage) -> bool:
        """Take in how a 401 asks for a user; says whether that can be answered."""
        return self._authorization is not None and self._authorization.asked(asked.all("WWW-Authenticate"))

    def failed(self, why: str) -> None:
        """Keep what the camera answered, for whoever asks why there is no stream."""
        self._why = why


class _Talk:
    """What FFmpeg and the camera say to each other over one pair of connections."""

    def __init__(self, relay: Relay, to_camera: asyncio.StreamWriter, to_player: asyncio.StreamWriter) -> None:
        self._relay = relay
        self._to_camera = to_camera
        self._to_player = to_player
        # By the number that the camera knows a request by; those of FFmpeg would repeat with a request that is signed.
        self._open: dict[str, _Sent] = {}
        self._number = 0

    async def requests(self, player: asyncio.StreamReader) -> None:
        """Pass on what FFmpeg says, until it says no more."""
        while (said := await read(player)) is not None:
            if isinstance(said, bytes):
                await _send(self._to_camera, said)
            elif not said.is_response:
                await self.ask(said)

    async def responses(self, camera: asyncio.StreamReader) -> None:
        """Pass on what the camera says, until it says no more; raises `_Refused` for a redirect and for a denial."""
        while (said := await read(camera)) is not None:
            if isinstance(said, bytes):
                await _send(self._to_player, said)
            elif said.is_response:
                await self._answered(said)
            elif said.method == "REDIRECT":
                raise _Refused(_leads(said, "it told the service to go on"))

    async def ask(self, request: RtspMessage) -> None:
        """Send a request of FFmpeg's to the camera."""
        await self._ask(self._relay.meant(request), 1)

    async def _ask(self, request: RtspMessage, attempt: int) -> None:
        self._number += 1
        signature = self._relay.signed(request)
        sent = request.having("CSeq", str(self._number))
        if signature is not None:
            sent = sent.having("Authorization", signature)
        self._open[str(self._number)] = _Sent(request, attempt)
        await _send(self._to_camera, sent.encoded())

    async def _answered(self, response: RtspMessage) -> None:
        sent = self._open.pop("".join(response.all("CSeq")), None)
        if sent is None:
            return
        method = sent.request.method
        if 300 <= response.status < 400:
            raise _Refused(_leads(response, f"it answered {response.status} to {method} and leads"))
        # The second time with user and password, or with a younger nonce; then they are wrong.
        if response.status == UNAUTHORIZED and sent.attempt == 1 and self._relay.can_sign(response):
            await self._ask(sent.request, 2)
            return
        if response.status in DENIED:
            # FFmpeg would ask again, and cameras lock users out that try too often.
            advice = "check address, user and password with any player of RTSP"
            raise _Refused(f"it answered {response.status} to {method}; {advice}")
        if response.status >= 400:
            self._relay.failed(f"it answered {response.status} to {method}")
        await _send(self._to_player, response.having("CSeq", "".join(sent.request.all("CSeq"))).encoded())


class _Refused(Exception):  # noqa: N818
    """The camera leads to another address, which the message names, or denies the user."""


def _leads(message: RtspMessage, said: str) -> str:
    """What is told of a redirect: the host that it leads to, and nothing of the address that may be a secret."""
    try:
        parts = urlsplit("".join(message.all("Location")))
        host = f"[{parts.hostname}]" if ":" in (parts.hostname or "") else parts.hostname
        port = "" if parts.port is None else f":{parts.port}"
    except ValueError:
        host, port = None, ""
    place = f"{parts.scheme}://{host}{port}" if host and f"{parts.scheme}{host}".isprintable() else "another address"
    return f"{said} to {place[:200]}, which is not followed; give the address that it leads to"


def _tls() -> ssl.SSLContext:
    """Encryption without a look at the certificate: cameras sign their own."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


async def _send(to: asyncio.StreamWriter, data: bytes) -> None:
    to.write(data)
    await to.drain()
