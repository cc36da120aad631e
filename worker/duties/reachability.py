"""Reachability of camera hosts: found by a TCP connection, and by earlier fetches, before a fetch is begun.

To connect costs a thread that waits, to fetch a process of its own: many hosts can be tried at once, and of a host that
is known to be silent nothing is fetched at all for a while.
"""

import socket
import threading
import time
from collections import Counter
from collections.abc import Iterable, Sequence

import httpx

from service.schemas import hosts
from worker.duties import outbound_guard
from worker.sources.connection import CONNECT_S, port_of

SILENT_S = 30.0
"""For so long a host that was silent is taken to be so still."""
LATE_TO_BE_SILENT = 2
"""So many fetches in a row that got no frame in their time make a host silent: one may be one camera of many on it."""
Host = tuple[str, int]


class HostReachability:
    """Remembers which hosts of camera sources are silent. Thread-safe."""

    def __init__(self, allowed: Sequence[str]) -> None:
        self._allowed = allowed
        self._lock = threading.Lock()
        self._silent_until: dict[Host, float] = {}
        self._late: Counter[Host] = Counter()

    def is_silent(self, sources: Iterable[str]) -> bool:
        """True if the host of one of the sources was silent within the last `SILENT_S` seconds."""
        now = time.monotonic()
        with self._lock:
            return any(self._silent_until.get(_host(httpx.URL(source)), now) > now for source in sources)

    def connect(self, sources: Iterable[str]) -> bool:
        """Connect to the hosts of the sources; return False, and remember it, if one of them times out.

        A host that refuses, or that cannot be looked up, counts as answering: the fetch reports what is wrong with it.
        """
        for host, source in {_host(httpx.URL(source)): source for source in sources}.items():
            if not self._responds(httpx.URL(source), host):
                with self._lock:
                    self._mark_silent(host)
                return False
        return True

    def note_late(self, source: str) -> None:
        """Note that a fetch from a source got no frame within its time."""
        host = _host(httpx.URL(source))
        with self._lock:
            self._late[host] += 1
            if self._late[host] >= LATE_TO_BE_SILENT:
                self._mark_silent(host)

    def note_answers(self, sources: Iterable[str]) -> None:
        """Note that the hosts of the sources gave their frames."""
        with self._lock:
            for host in {_host(httpx.URL(source)) for source in sources}:
                self._late.pop(host, None)
                self._silent_until.pop(host, None)

    def _mark_silent(self, host: Host) -> None:
        now = time.monotonic()
        still = {other: until for other, until in self._silent_until.items() if until > now}
        self._silent_until = still | {host: now + SILENT_S}

    def _responds(self, target: httpx.URL, host: Host) -> bool:
        try:
            addresses = outbound_guard.look_up(target)
        except outbound_guard.HostNotFoundError:
            return True
        # To what ESC_SOURCES does not name no connection is made.
        permitted = hosts.permitted_addresses(target.host, addresses, self._allowed)
        return not permitted or any(_accepts(address, host[1]) for address in permitted)


def _accepts(address: str, port: int) -> bool:
    try:
        socket.create_connection((address, port), CONNECT_S).close()
    except TimeoutError:
        return False
    except OSError:
        return True
    return True


def _host(source: httpx.URL) -> Host:
    return source.host, port_of(source)
