"""The guard of outbound HTTP: requests go to addresses that were checked, and to no others.

A name is looked up once and the connection is made to an address of that answer: a name that points elsewhere a moment
later (DNS rebinding) leads nowhere. Redirects are not followed and proxies of the environment are not used, for the
same reason.
"""

import socket
import threading

import httpx

from worker.sources.connection import port_of

# Resolvers ask several servers, each several times, for as long as they are set to.
LOOK_UP_S = 5.0


class HostNotFoundError(Exception):
    """The DNS look-up of a host name failed; the message says why."""


def look_up(target: httpx.URL) -> list[str]:
    """Return the IP addresses of the host of a URL. Raises `HostNotFoundError`."""
    name, port = target.raw_host.decode("ascii"), port_of(target)
    looked_up: list[list[str] | str] = []

    def resolve() -> None:
        try:
            found = socket.getaddrinfo(name, port, type=socket.SOCK_STREAM)
            looked_up.append([str(address[0]) for *_, address in found])
        except (OSError, UnicodeError) as error:
            looked_up.append(str(error))

    # Nothing ends a look-up: it goes on in a daemon thread that nobody waits for.
    thread = threading.Thread(target=resolve, daemon=True)
    thread.start()
    thread.join(LOOK_UP_S)
    match looked_up:
        case [list(addresses)]:
            return addresses
        case [why]:
            raise HostNotFoundError(f"{name} cannot be looked up: {why}")
        case _:
            raise HostNotFoundError(f"{name} cannot be looked up within {LOOK_UP_S:g} s")


def failure_text(error: httpx.HTTPError) -> str:
    """Return why a request failed, in words of our own.

    Those of httpx repeat what a server said that speaks another protocol, to whoever could name its address.
    """
    match error:
        case httpx.ConnectError():
            # By the operating system or OpenSSL.
            return f"no connection: {error}"
        case httpx.TimeoutException():
            return "no answer in time"
        case httpx.NetworkError():
            return "the connection broke off"
        case httpx.RemoteProtocolError():
            return "no whole answer by HTTP: it speaks another protocol, or the connection broke off"
        case _:
            return f"no answer that can be read ({type(error).__name__})"
