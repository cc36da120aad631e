"""Network cameras: HTTP servers that show a frame, ask for a password, or misbehave."""

import hashlib
import threading
import time
from base64 import b64encode
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from testbed.running import png

REALM = 'realm="camera", nonce="abc", qop="auth"'


class NetworkCamera:
    """Answers at `/ok`, `/basic`, `/digest` (user:pass word), `/gone`, `/elsewhere`, `/hang`, `/drip`, `/endless`,
    `/mjpeg` and its kind, `/text`, `/small`; `asked` counts what came."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                camera.asked.append(self.path)
                with suppress(OSError):
                    camera.answer(self)

            def log_message(self, *_):
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.host = f"127.0.0.1:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def url(self, path: str, userinfo: str = "") -> str:
        return f"http://{userinfo}{self.host}{path}"

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        match request.path:
            case "/ok":
                self._send(request, 200, png())
            case "/basic":
                given = request.headers.get("authorization")
                if given == f"Basic {b64encode(b'user:pass word').decode()}":
                    self._send(request, 200, png())
                else:
                    self._send(request, 401, b"", **{"WWW-Authenticate": 'Basic realm="camera"'})
            case "/digest":
                given = request.headers.get("authorization", "")
                right = given.startswith("Digest ") and _digest(given) in given
                headers = {} if right else {"WWW-Authenticate": f"Digest {REALM}"}
                self._send(request, 200 if right else 401, png() if right else b"", **headers)
            case "/snap?usr=admin&pwd=hunter2":
                self._send(request, 200, png())
            case "/elsewhere":
                self._send(request, 302, b"", Location="/ok")
            case "/hang":
                time.sleep(3600)
            case "/drip":
                request.wfile.write(b"HTTP/1.1 200 OK\r\nX-Slow: ")
                while True:
                    request.wfile.write(b"x")
                    time.sleep(0.05)
            case "/endless":
                request.send_response(200)
                request.end_headers()
                while True:
                    request.wfile.write(bytes(65536))
            case "/mjpeg":
                self._endless(request, b"--x\r\nContent-Type: image/png\r\n\r\n" + png() + b"\r\n")
            case "/mjpeg-never-whole":
                self._endless(request, b"--x\r\nContent-Length: 99999999\r\n\r\n" + bytes(65536), bytes(65536))
            case "/mjpeg-silent":
                self._endless(request, b"--x\r\nContent-Length: 9\r\n\r\n", b"")
            case "/mjpeg-short":
                self._send(request, 200, b"--x", **{"Content-Type": "multipart/x-mixed-replace; boundary=x"})
            case "/text":
                self._send(request, 200, b"<html>")
            case "/small":
                self._send(request, 200, png(32, 40))
            case _:
                self._send(request, 404, b"")

    def _send(self, request: BaseHTTPRequestHandler, status: int, body: bytes, **headers: str) -> None:
        request.send_response(status)
        for name, value in headers.items():
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(body)

    def _endless(self, request: BaseHTTPRequestHandler, first: bytes, then: bytes | None = None) -> None:
        request.send_response(200)
        request.send_header("Content-Type", "multipart/x-mixed-replace; boundary=x")
        request.end_headers()
        request.wfile.write(first)
        while True:
            request.wfile.write(first if then is None else then)
            time.sleep(0.01)

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


def _digest(given: str) -> str:
    """RFC 7616 with MD5, for the nonces that came."""
    fields = dict(part.strip().split("=", 1) for part in given.removeprefix("Digest ").split(","))
    first = hashlib.md5(b"user:camera:pass word").hexdigest()
    second = hashlib.md5(b"GET:/digest").hexdigest()
    parts = [first, "abc", fields["nc"], fields["cnonce"].strip('"'), "auth", second]
    return hashlib.md5(":".join(parts).encode()).hexdigest()
