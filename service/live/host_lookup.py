"""Addresses of the hosts that poses are sent to: a name is looked up beside the sending, which never waits for it."""

from __future__ import annotations

import socket
import threading
import time
from typing import Any

# A renderer that got another address is sent to again after so long; no resolver minds the question.
LOOK_UP_AGAIN_S = 60.0
# After a look-up that failed.
FAILED_AGAIN_S = 5.0
# A first look-up that goes on for longer is trouble; most take milliseconds, a resolver's own time-out is 5 s at least.
SLOW_S = 3.0


# Family, and what `socket.sendto` takes.
SocketAddress = tuple[int, tuple[Any, ...]]


class HostLookup:
    """Knows the address of `host`, a name or an address, at a UDP port.

    A name is looked up in a thread of its own, again and again until `close`: a resolver may be silent for as long as
    it is set to. The last answer holds.
    """

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self._address: SocketAddress | None = None
        self._error: str | None = None
        self._begun_s = time.monotonic()
        self._closed = threading.Event()
        try:
            # An address needs no resolver.
            self._address = _look_up(host, port, socket.AI_NUMERICHOST)
        except (OSError, UnicodeError):
            threading.Thread(target=self._keep_looking_up, daemon=True).start()

    def address(self) -> SocketAddress | None:
        """Return family and socket address; None while the first look-up goes on. Raises `OSError` where it fails."""
        if self._address is None:
            if self._error is not None:
                raise OSError(self._error)
            if time.monotonic() - self._begun_s > SLOW_S:
                raise OSError(f"{self._host} cannot be looked up: the name server is silent")
        return self._address

    def close(self) -> None:
        """Look it up no more; nobody waits for a look-up that goes on."""
        self._closed.set()

    def _keep_looking_up(self) -> None:
        pause_s = 0.0
        while not self._closed.wait(pause_s):
            try:
                self._address, pause_s = _look_up(self._host, self._port), LOOK_UP_AGAIN_S
            # A label of a name that is empty or too long is a `UnicodeError`.
            except (OSError, UnicodeError) as error:
                self._error, pause_s = f"{self._host} cannot be looked up: {error}", FAILED_AGAIN_S


def _look_up(host: str, port: int, flags: int = 0) -> SocketAddress:
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM, flags=flags)[0]
    return family, address
