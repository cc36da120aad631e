"""Requests to addresses that were checked, and to no others.

A name is looked up once and the connection is made to an address of that answer: a name that points elsewhere a moment
later (DNS rebinding) leads nowhere. Redirects are not followed and proxies of the environment are not used, for the
same reason.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from contextlib import AbstractAsyncContextManager
from importlib.metadata import version

import httpx

PORTS = {"http": 80, "https": 443, "rtsp": 554, "rtsps": 322}


class NotFound(Exception):  # noqa: N818
    """The name leads to no address; the message says why."""


def look_up(target: httpx.URL) -> list[str]:
    """The addresses of the host of a URL."""
    name, port = target.raw_host.decode("ascii"), target.port or PORTS[target.scheme]
    try:
        found = socket.getaddrinfo(name, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise NotFound(f"{name} cannot be looked up: {error}") from None
    return [str(address[0]) for *_, address in found]


def stream(
    client: httpx.AsyncClient,
    method: str,
    target: httpx.URL,
    address: str,
    *,
    content: bytes | None = None,
    headers: Mapping[str, str] | None = None,
    auth: httpx.Auth | None = None,
) -> AbstractAsyncContextManager[httpx.Response]:
    """Ask the host of a URL at one of its addresses."""
    head = {
        **(headers or {}),
        "Host": target.netloc.decode("ascii"),
        "User-Agent": f"esc/{version('esc-calibration')}",
    }
    # The certificate is checked against the name, whatever address the connection goes to.
    name = {"sni_hostname": target.raw_host.decode("ascii")}
    at = target.copy_with(host=address)
    return client.stream(method, at, content=content, headers=head, extensions=name, auth=auth)
