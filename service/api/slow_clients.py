"""Time limits of connections to slow clients, and their number.

Uvicorn closes a connection that is idle between two requests and waits for ever for anybody else: for the rest of a
head, for the rest of a body, for an answer to be taken. A thousand such clients cost nothing to run and hold every
connection that a process may have. Here clients that owe bytes have a time limit: the server looks at all connections
once a second and closes those over the limit, with an answer where that is still possible. Uvicorn has no option for
this.
"""

import asyncio
import socket
from collections import OrderedDict
from typing import Any, Literal

import h11
import structlog
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.api.problems import problem_response
from service.schemas.problems import Problem

# What the client owes: the head of a request, its body, or taking an answer.
Owed = Literal["head", "body", "taking"]
LOGGED_EVERY_S = 10.0
log = structlog.get_logger()


class ConnectionLimiter:
    """Limits how many clients are connected.

    The one that has been silent for longest, with no request under way, makes room for the next: whoever opens
    connections and says nothing keeps nobody out.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        # In the order in which they last sent something.
        self._connected: OrderedDict[Connection, None] = OrderedDict()
        self._logged_at = -LOGGED_EVERY_S

    def admit(self, connection: "Connection", now: float) -> bool:
        """Admit a client if there is room or can be made; False if not."""
        if len(self._connected) >= self._most:
            if now - self._logged_at >= LOGGED_EVERY_S:
                self._logged_at = now
                log.warning("too many clients are connected, silent ones make room", connections=self._most)
            if not self._make_room():
                return False
        self._connected[connection] = None
        return True

    def touch(self, connection: "Connection") -> None:
        """Note that a client has sent something."""
        if connection in self._connected:
            self._connected.move_to_end(connection)

    def remove(self, connection: "Connection") -> None:
        """Forget a client that is gone."""
        self._connected.pop(connection, None)

    def _make_room(self) -> bool:
        for _ in range(len(self._connected)):
            connection, _nothing = self._connected.popitem(last=False)
            if connection.is_silent:
                connection.transport.abort()
                return True
            self._connected[connection] = None
        return False


class Connection(H11Protocol):
    """Uvicorn's HTTP/1.1 connection that remembers since when its client owes bytes."""

    def __init__(self, limiter: ConnectionLimiter, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._limiter = limiter
        self._owed: Owed | None = None
        self._owed_since = 0.0
        self._progress_at = 0.0
        self._unsent_bytes = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Admit or refuse a client that has connected."""
        # asyncio sets this only where a socket names its protocol, and those of a listener do not. Without it the body
        # of an answer waits until its head has been acknowledged, which clients put off by 40 ms.
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().connection_made(transport)
        if not self._limiter.admit(self, self.loop.time()):
            self._refuse(Problem("unavailable", "Too many clients are connected.", headers={"Retry-After": "5"}))

    def connection_lost(self, exc: Exception | None) -> None:
        """Free the place of the client."""
        self._limiter.remove(self)
        super().connection_lost(exc)

    @property
    def is_silent(self) -> bool:
        """True if the client waits for nothing: it has asked nothing yet, or has its answer."""
        answered = self.cycle is not None and self.cycle.response_complete
        return (answered or self.conn.their_state is h11.IDLE) and not self.transport.get_write_buffer_size()

    def close_if_overdue(self, now: float, stall_s: float, whole_s: float) -> None:
        """End the connection if nothing moved for `stall_s`, or what moves has not come to its end for `whole_s`."""
        owed = self._what_is_owed()
        unsent_bytes = self.transport.get_write_buffer_size()
        if owed != self._owed:
            self._owed, self._owed_since, self._progress_at = owed, now, now
        elif (owed == "taking" and unsent_bytes < self._unsent_bytes) or (owed == "body" and self.flow.read_paused):
            self._progress_at = now
        self._unsent_bytes = unsent_bytes
        if owed is None:
            return
        # A head is small: it is whole in the time in which anything else must only move.
        if now - self._progress_at > stall_s or now - self._owed_since > whole_s:
            self._close_slow(owed)

    def data_received(self, data: bytes) -> None:
        """Note that the client has sent something, and parse it."""
        self._limiter.touch(self)
        if self._owed == "body":
            self._progress_at = self.loop.time()
        super().data_received(data)

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002
        """Answer bytes that are no HTTP."""
        self._refuse(Problem("malformed-request", "This is no HTTP/1.1 request, or its head is larger than 64 kB."))

    def _what_is_owed(self) -> Owed | None:
        if self.transport.get_write_buffer_size():
            return "taking"
        if self.conn.their_state is h11.SEND_BODY:
            return "body"
        begun = self.cycle is None or bool(self.conn.trailing_data[0])
        return "head" if begun and self.conn.their_state is h11.IDLE else None

    def _close_slow(self, owed: Owed) -> None:
        log.info("slow client disconnected", owed=owed, address=self.client[0] if self.client else "")
        if owed == "taking":
            self.transport.abort()
            return
        self._refuse(Problem("too-slow", f"The {owed} of the request did not come to its end in time."))

    def _refuse(self, problem: Problem) -> None:
        """Answer, if no answer has begun, and close; the application stops to wait for the rest of the request."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            response = problem_response(problem)
            head = [*response.raw_headers, (b"connection", b"close")]
            for part in (
                h11.Response(status_code=response.status_code, headers=head),
                h11.Data(data=bytes(response.body)),
                h11.EndOfMessage(),
            ):
                self.transport.write(self.conn.send(part) or b"")
        if self.cycle is not None:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        self.transport.close()


def close_slow_connections(server: uvicorn.Server, now: float, stall_s: float, whole_s: float) -> None:
    """Close every connection of a server whose client owes bytes for too long."""
    for connection in list(server.server_state.connections):
        if isinstance(connection, Connection):
            connection.close_if_overdue(now, stall_s, whole_s)
