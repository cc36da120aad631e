"""Look-up of the hosts that poses are sent to, in a thread: sending never waits for a name server."""

import socket
import threading
import time
from typing import Any

# A renderer with a new address is found after this time.
LOOK_UP_AGAIN_S = 60.0
# Pause after a failed look-up.
FAILED_AGAIN_S = 5.0
# A longer first look-up is reported: most take milliseconds, and resolvers time out after 5 s at least.
SLOW_S = 3.0


# Family, and the address for `socket.sendto`.
SocketAddress = tuple[int, tuple[Any, ...]]


class HostLookup:
    """The current address of `host`, a name or an IP address, at a UDP port.

    A name is looked up in a thread, repeatedly until `close`; the last answer is used.
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
        """Return family and socket address; None during the first look-up. Raises `OSError` if that failed."""
        if self._address is None:
            if self._error is not None:
                raise OSError(self._error)
            if time.monotonic() - self._begun_s > SLOW_S:
                raise OSError(f"{self._host} cannot be looked up: the name server is silent")
        return self._address

    def close(self) -> None:
        """Stop looking up, without waiting for the thread."""
        self._closed.set()

    def _keep_looking_up(self) -> None:
        pause_s = 0.0
        while not self._closed.wait(pause_s):
            try:
                self._address, pause_s = _look_up(self._host, self._port), LOOK_UP_AGAIN_S
            # An empty or too long label of a name raises `UnicodeError`.
            except (OSError, UnicodeError) as error:
                self._error, pause_s = f"{self._host} cannot be looked up: {error}", FAILED_AGAIN_S


def _look_up(host: str, port: int, flags: int = 0) -> SocketAddress:
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM, flags=flags)[0]
    return family, address
