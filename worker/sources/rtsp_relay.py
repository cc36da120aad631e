"""A relay on loopback between FFmpeg and a camera: FFmpeg knows no password and reaches no other host.

FFmpeg follows the redirects of a server of RTSP, and answers the host that they lead to with the password of the first.
A look ahead would not help: a camera may answer once and redirect later. So FFmpeg is given the address of this relay.
The relay connects to the address that was checked, signs the requests that the camera asks to have signed, and takes
any redirect for the end.
"""

import asyncio
import secrets
import threading
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace

import httpx

from worker.sources.authorization import Authorization, denied
from worker.sources.connection import connect
from worker.sources.errors import CameraError
from worker.sources.messages import LONGEST_HEAD, Message, read, redirect_in_words

UNAUTHORIZED = 401
DENIED = (UNAUTHORIZED, 403)
UNSUPPORTED_TRANSPORT = 461
STARTING_S = 10.0
# What FFmpeg may speak, to the relay; `file` and the like are not among them. TCP: a lost packet is a grey stripe.
FFMPEG_OPTIONS = {"rtsp_transport": "tcp", "protocol_whitelist": "rtsp,rtp,tcp"}


@dataclass(frozen=True)
class _Sent:
    """A request as FFmpeg sent it, but for its URI, and the ways of proving a user that were tried for it."""

    request: Message
    tried: tuple[str, ...] = ()


class Relay:
    """Relays one stream of a camera, from entering the `with` block to leaving it.

    `target`: the camera's URL without user and password; `addresses`: where its host is, checked; `userinfo`: as it
    stands in a URL, or None.
    """

    def __init__(self, target: httpx.URL, addresses: Sequence[str], userinfo: str | None) -> None:
        self._target = target
        self._addresses = addresses
        self.authorization = Authorization(userinfo)
        # Other users of this machine reach the port as well.
        self._token = secrets.token_urlsafe(16)
        self._loop = asyncio.new_event_loop()
        self._end = asyncio.Event()
        self._talks: set[asyncio.Task[None]] = set()
        self._transports: weakref.WeakSet[asyncio.WriteTransport] = weakref.WeakSet()
        self._listening = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="rtsp-relay")
        self._here = ""
        self._why: str | None = None

    def __enter__(self) -> "Relay":
        self._thread.start()
        if not self._listening.wait(STARTING_S):
            raise OSError("the relay of a stream did not start")
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
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
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._relay())

    async def _relay(self) -> None:
        server = await asyncio.start_server(self._accept, "127.0.0.1", 0, limit=LONGEST_HEAD)
        self._here = f"rtsp://127.0.0.1:{server.sockets[0].getsockname()[1]}/{self._token}"
        self._listening.set()
        await self._end.wait()
        # A connection may be about to be accepted: its talk begins while the others end. asyncio would leave it open if
        # the server were closed by then.
        while others := asyncio.all_tasks() - {asyncio.current_task()}:
            for talk in self._talks:
                talk.cancel()
            # Not `close`, which waits until all that was written is read, and over TLS for the camera's farewell.
            for transport in self._transports:
                transport.abort()
            await asyncio.wait(others)
        server.close()

    def _accept(self, player: asyncio.StreamReader, to_player: asyncio.StreamWriter) -> None:
        # No coroutine: one that is cancelled before its first step would leave the connection open.
        self._transports.add(to_player.transport)
        talk = asyncio.create_task(self._serve(player, to_player))
        self._talks.add(talk)
        talk.add_done_callback(self._talks.discard)

    async def _serve(self, player: asyncio.StreamReader, to_player: asyncio.StreamWriter) -> None:
        try:
            first = await read(player)
            if not isinstance(first, Message) or self._here not in first.first:
                return
            camera, to_camera = await connect(self._target, self._addresses)
            self._transports.add(to_camera.transport)
            try:
                talk = _Talk(self, to_camera, to_player)
                await talk.ask(first)
                both = [asyncio.ensure_future(talk.requests(player)), asyncio.ensure_future(talk.responses(camera))]
                try:
                    await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
                finally:
                    for one in both:
                        one.cancel()
                    ends = await asyncio.gather(*both, return_exceptions=True)
                for end in ends:
                    if isinstance(end, Exception):
                        raise end
            finally:
                to_camera.close()
        except CameraError as error:
            self._why = str(error)
        except OSError as error:
            self._why = self._why or f"the connection broke off: {error.strerror or error}"
        finally:
            to_player.close()

    def meant(self, request: Message) -> Message:
        """The request with the camera's address in place of the relay's."""
        there = f"{self._target.scheme}://{self._target.netloc.decode('ascii')}"
        return replace(request, first=request.first.replace(self._here, there, 1))

    def failed(self, why: str) -> None:
        """Keep what the camera answered, for whoever asks why there is no stream."""
        self._why = why


class _Talk:
    """The conversation of FFmpeg and the camera over one pair of connections."""

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
        """Pass on what the camera says, until it says no more; raises `CameraError` for a redirect and for a denial."""
        while (said := await read(camera)) is not None:
            if isinstance(said, bytes):
                await _send(self._to_player, said)
            elif said.is_response:
                await self._answered(said)
            elif said.method == "REDIRECT":
                raise CameraError(redirect_in_words(said, "it sent the service on"))

    async def ask(self, request: Message) -> None:
        """Send a request of FFmpeg's to the camera."""
        await self._ask(_Sent(self._relay.meant(request)))

    async def _ask(self, sent: _Sent) -> None:
        self._number += 1
        method, uri, *_ = (*sent.request.first.split(), "", "")
        signature = self._relay.authorization.header(method, uri) if uri else None
        signed = sent.request.having("CSeq", str(self._number))
        if signature is not None:
            signed = signed.having("Authorization", signature)
        self._open[str(self._number)] = sent
        await _send(self._to_camera, signed.encoded())

    async def _answered(self, response: Message) -> None:
        sent = self._open.pop("".join(response.all("CSeq")), None)
        if sent is None:
            return
        method, status = sent.request.method, response.status
        if 300 <= status < 400:
            raise CameraError(redirect_in_words(response, f"it answered {status} to {method} and leads"))
        if status == UNAUTHORIZED:
            way = self._relay.authorization.choose(response.all("WWW-Authenticate"), sent.tried)
            if way is not None:
                await self._ask(replace(sent, tried=(*sent.tried, way)))
                return
        if status in DENIED:
            # FFmpeg would ask again, and cameras lock users out that try too often.
            raise CameraError(denied(status, response.all("WWW-Authenticate"), f" to {method}"))
        if status == UNSUPPORTED_TRANSPORT:
            raise CameraError(
                f"it answered {status} to {method}: it sends its stream by UDP only, and the service takes TCP. Set it "
                "to TCP (interleaved), or put go2rtc or MediaMTX between"
            )
        if status >= 400:
            self._relay.failed(f"it answered {status} to {method}")
        await _send(self._to_player, response.having("CSeq", "".join(sent.request.all("CSeq"))).encoded())


async def _send(to: asyncio.StreamWriter, data: bytes) -> None:
    to.write(data)
    await to.drain()
