"""Connections to clients that take their time, or speak no HTTP.

Uvicorn closes a connection that is idle between two requests and waits for ever for anybody else: for the rest of a
head, for the rest of a body, for an answer to be taken. A thousand such clients cost nothing to run and hold every
connection that a process may have. Here a client that owes bytes has a limit, the server looks at all connections once
a second, and who is over the limit is told so where that is still possible, and let go.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any, Literal

import h11
import structlog
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.api.problems import answer
from service.wire.problems import Problem

# What the client owes: the head of a request, its body, or taking an answer.
Owed = Literal["head", "body", "taking"]
log = structlog.get_logger()


class Connection(H11Protocol):
    """Uvicorn's connection, with a memory of who is waiting for whom."""

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._owed: Owed | None = None
        self._owed_since = 0.0
        self._moved_at = 0.0
        self._left_to_take = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client has connected."""
        # asyncio sets this only where a socket names its protocol, and those of a listener do not. Without it the body
        # of an answer waits until its head has been acknowledged, which clients put off by 40 ms.
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().connection_made(transport)

    def let_go_if_overdue(self, now: float, stall_s: float, whole_s: float) -> None:
        """End the connection if nothing moved for `stall_s`, or what moves has not come to its end for `whole_s`."""
        owed = self._what_is_owed()
        left = self.transport.get_write_buffer_size()
        if owed != self._owed:
            self._owed, self._owed_since, self._moved_at = owed, now, now
        elif (owed == "taking" and left < self._left_to_take) or (owed == "body" and self.flow.read_paused):
            self._moved_at = now
        self._left_to_take = left
        if owed is None:
            return
        # A head is small: it is whole in the time in which anything else must only move.
        if now - self._moved_at > stall_s or now - self._owed_since > whole_s:
            self._let_go(owed)

    def data_received(self, data: bytes) -> None:
        """Something came."""
        if self._owed == "body":
            self._moved_at = self.loop.time()
        super().data_received(data)

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002
        """What came is no HTTP."""
        self._refuse(Problem("malformed-request", "This is no HTTP/1.1 request, or its head is larger than 64 kB."))

    def _what_is_owed(self) -> Owed | None:
        if self.transport.get_write_buffer_size():
            return "taking"
        if self.conn.their_state is h11.SEND_BODY:
            return "body"
        begun = self.cycle is None or bool(self.conn.trailing_data[0])
        return "head" if begun and self.conn.their_state is h11.IDLE else None

    def _let_go(self, owed: Owed) -> None:
        log.info("client let go", owed=owed, address=self.client[0] if self.client else "")
        if owed == "taking":
            self.transport.abort()
            return
        self._refuse(Problem("too-slow", f"The {owed} of the request did not come to its end in time."))

    def _refuse(self, problem: Problem) -> None:
        """Answer, where no answer has begun, and close; whoever waits for the rest of the request waits no longer."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            response = answer(problem)
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


def let_go_of_the_slow(server: uvicorn.Server, now: float, stall_s: float, whole_s: float) -> None:
    """Look at every connection of a server."""
    for connection in list(server.server_state.connections):
        if isinstance(connection, Connection):
            connection.let_go_if_overdue(now, stall_s, whole_s)
