"""A receiver of webhooks on a real socket."""

import socket
import ssl
import threading
import time
from base64 import b64encode
from contextlib import suppress
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

# Settings of a service that may call a receiver of this machine, and signs what it sends.
SECRET = "whsec_" + b64encode(bytes(32)).decode()
LOCAL = {"ESC_WEBHOOK_SECRET": SECRET, "ESC_CALLBACK_ALLOW_HTTP": "true", "ESC_CALLBACK_ALLOW_PRIVATE": "true"}
# What servers say of their own accord, which nobody is to read through the service.
TELLTALE = (
    b"220 admin console, token=hunter2\r\n\r\n",
    b"HTTP/1.1 500 token=hunter2\r\n\r\n",
    b"HTTP/1.1 200 OK\r\ntoken hunter2\r\n\r\n",
    b"HTTP/1.1 200 OK\r\nContent-Type: token/hunter2\r\n\r\n",
    b"HTTP/1.1 200 OK\r\nTransfer-Encoding: token=hunter2\r\n\r\n",
    b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nhunter2\r\n",
    b"HTTP/1.1 401 token\r\nWWW-Authenticate: Digest hunter2\r\n\r\n",
)


@dataclass(frozen=True)
class Received:
    path: str
    headers: dict[str, str]
    body: bytes


class Receiver:
    """Answers with `statuses` one after the other, the last again and again; keeps what came in `received`."""

    def __init__(self, *statuses: int, headers: dict | None = None, certificate: Path | None = None) -> None:
        self.statuses = list(statuses) or [204]
        self.headers = headers or {}
        self.received: list[Received] = []
        self.broken_off = threading.Event()
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self):
                receiver.answer(self)

            def log_message(self, *_):
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        if certificate is not None:
            tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            tls.load_cert_chain(certificate)
            self._server.socket = tls.wrap_socket(self._server.socket, server_side=True)
        self.port = self._server.server_port
        self.url = f"http://127.0.0.1:{self.port}/told?by=esc"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        body = request.rfile.read(int(request.headers["content-length"]))
        headers = {name.lower(): value for name, value in request.headers.items()}
        self.received.append(Received(request.path, headers, body))
        status = self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]
        with suppress(OSError):
            self.respond(request, status)

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        request.send_response(status)
        for name, value in self.headers.items():
            request.send_header(name, value)
        request.end_headers()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class Talkative(Receiver):
    """Says what only those shall read who may ask it."""

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        super().respond(request, status)
        request.wfile.write(b"its secret")


class Silent(Receiver):
    """Takes what comes and says nothing."""

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        time.sleep(3600)


class Holding(Receiver):
    """Takes what comes, and answers when it is let go."""

    def __init__(self) -> None:
        self.go = threading.Event()
        super().__init__()

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        self.go.wait(60)
        super().respond(request, status)

    def close(self) -> None:
        self.go.set()
        super().close()


class Dripping(Receiver):
    """Sends a byte of its headers, and another, and another."""

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        request.wfile.write(b"HTTP/1.1 200 OK\r\nX-Slow: ")
        while True:
            request.wfile.write(b"x")
            time.sleep(0.05)


class Endless(Receiver):
    """Sends a body without an end."""

    def respond(self, request: BaseHTTPRequestHandler, status: int) -> None:
        super().respond(request, status)
        try:
            while True:
                request.wfile.write(bytes(65536))
        except OSError:
            self.broken_off.set()


class Telltale(Receiver):
    """Says the bytes `says` in answer to whatever is asked, in a protocol of its own perhaps."""

    says = b""

    def respond(self, request: BaseHTTPRequestHandler, _: int) -> None:
        request.wfile.write(self.says)
        request.close_connection = True


def resolve_to(monkeypatch: pytest.MonkeyPatch, *answers: list[str]) -> list[str]:
    """Let every name have these addresses, the last answer for ever; returns the list of names that were looked up."""
    asked, left = [], list(answers)

    def getaddrinfo(name, port, *_, **__):
        asked.append(name)
        answer = left.pop(0) if len(left) > 1 else left[0]
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port)) for address in answer]

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    return asked
