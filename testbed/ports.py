"""Ports of this machine for those who have to be told one before they listen on it."""

import secrets
import socket
from pathlib import Path

LOWEST, HIGHEST = 20000, 32767
"""Below those that Linux gives to outgoing connections: none of these takes the port before it is listened on."""


def free_port(kind=socket.SOCK_STREAM):
    """A port of that `kind` that nobody has."""
    while True:
        port = LOWEST + secrets.randbelow(HIGHEST - LOWEST + 1)
        with socket.socket(socket.AF_INET, kind) as one:
            try:
                one.bind(("127.0.0.1", port))
            except OSError:
                continue
        return port


def is_listened_on(port, protocol="tcp"):
    """True if a socket listens on a port: it is bound and connected to nobody."""
    return f":{port:04X} 00000000:0000 " in Path(f"/proc/net/{protocol}").read_text()
