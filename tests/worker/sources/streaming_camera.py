"""A camera that streams by RTSP, over a real socket."""

import hashlib
import re
import socket
import struct
import threading
from base64 import b64encode
from contextlib import suppress
from dataclasses import dataclass
from itertools import count, cycle
from pathlib import Path

import cv2
import numpy as np

from tests.listener import Listener

USERINFO = "user:pass word"
ASKS = {
    "basic": 'Basic realm="camera"',
    "digest": 'Digest realm="camera", nonce="abc"',
    "digest with qop": 'Digest realm="camera", nonce="abc", qop="auth", algorithm=MD5, opaque="x"',
    "digest sha-256": 'Digest realm="camera", nonce="abc", qop="auth", algorithm=SHA-256',
}
SIZE = (64, 48)
SDP = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=c\r\nt=0 0\r\nm=video 0 RTP/AVP 26\r\na=control:track1\r\n"


@dataclass(frozen=True)
class Film:
    """What a camera sends again and again: the payloads of the packets of each picture."""

    sdp: str
    payload_type: int
    pictures: list[list[bytes]]


class Stranger(Listener):
    """A host that a camera leads to: keeps what is said to it."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        super().__init__()

    def converse(self, connection: socket.socket) -> None:
        self.heard.append(b"a connection")
        connection.sendall(b'RTSP/1.0 401 Unauthorized\r\nCSeq: 1\r\nWWW-Authenticate: Basic realm="x"\r\n\r\n')
        connection.settimeout(5)
        while data := connection.recv(4096):
            self.heard.append(data)


class StreamingCamera(Listener):
    """A stream by RTSP (RFC 2326), interleaved in one TCP connection, for user:pass word.

    `way`: how it asks for them. `leads`: the methods that it answers with a redirect, and where that leads. `film`:
    what it sends in place of Motion JPEG (RFC 2435) of one `shade`. `asked`: the requests that came, each with what
    proved its user.
    """

    def __init__(
        self,
        shade: int = 120,
        way: str = "basic",
        leads: dict[str, str] | None = None,
        certificate: Path | None = None,
        film: Film | None = None,
    ) -> None:
        self.asked: list[tuple[str, str]] = []
        self._way, self._leads = way, leads or {}
        frame = np.full((SIZE[1], SIZE[0], 3), shade, np.uint8)
        self._film = film or Film(SDP, 26, [[_rtp_payload(cv2.imencode(".jpg", frame)[1].tobytes())]])
        super().__init__(certificate=certificate)

    def converse(self, connection: socket.socket) -> None:
        stop = threading.Event()
        with suppress(OSError), connection.makefile("rb") as lines:
            while begin := lines.read(1):
                if begin == b"$":
                    lines.read(int.from_bytes(lines.read(3)[1:]))
                    continue
                request = begin + lines.readline()
                headers = {}
                while line := lines.readline().strip():
                    name, _, value = line.decode().partition(":")
                    headers[name.lower()] = value.strip()
                method, uri, _ = request.decode().split()
                self.asked.append((method, headers.get("authorization", "")))
                self._answer(connection, method, uri, headers, stop)
        stop.set()

    def _answer(self, connection, method, uri, headers, stop) -> None:
        more, body, status = {}, "", "200 OK"
        match method:
            case _ if method in self._leads:
                status, more = "302 Moved Temporarily", {"Location": self._leads[method]}
            case "OPTIONS":
                more["Public"] = "OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN"
            case _ if not self._knows(method, uri, headers.get("authorization", "")):
                status, more = "401 Unauthorized", {"WWW-Authenticate": ASKS[self._way]}
            case "DESCRIBE":
                body, more = self._film.sdp, {"Content-Type": "application/sdp"}
            case "SETUP":
                more = {"Transport": "RTP/AVP/TCP;unicast;interleaved=0-1", "Session": "1"}
            case "PLAY":
                more["Session"] = "1"
        head = {"CSeq": headers["cseq"], "Content-Length": str(len(body)), **more}
        lines = "".join(f"{name}: {value}\r\n" for name, value in head.items())
        connection.sendall(f"RTSP/1.0 {status}\r\n{lines}\r\n{body}".encode())
        if method == "PLAY" and status == "200 OK":
            threading.Thread(target=self._play, args=(connection, stop), daemon=True).start()

    def _knows(self, method: str, uri: str, given: str) -> bool:
        if self._way == "basic":
            return given == f"Basic {b64encode(USERINFO.encode()).decode()}"
        fields = dict(re.findall(r'(\w+)="?([^",]*)"?', given.removeprefix("Digest ")))
        hashed = hashlib.sha256 if self._way == "digest sha-256" else hashlib.md5
        user, password = USERINFO.split(":")
        secret = hashed(f"{user}:camera:{password}".encode()).hexdigest()
        what = hashed(f"{method}:{uri}".encode()).hexdigest()
        between = [fields.get("nc", ""), fields.get("cnonce", ""), "auth"] if "qop" in ASKS[self._way] else []
        expected = hashed(":".join([secret, "abc", *between, what]).encode()).hexdigest()
        return given.startswith("Digest ") and fields.get("uri") == uri and fields.get("response") == expected

    def _play(self, connection, stop) -> None:
        numbers = count()
        with suppress(OSError):
            for at, picture in enumerate(cycle(self._film.pictures)):
                if stop.wait(0.04):
                    return
                for payload in picture:
                    kind = self._film.payload_type | (0x80 if payload is picture[-1] else 0)
                    packet = struct.pack(">BBHII", 0x80, kind, next(numbers) & 0xFFFF, at * 3600, 7) + payload
                    connection.sendall(b"$\0" + struct.pack(">H", len(packet)) + packet)


def _rtp_payload(jpeg: bytes) -> bytes:
    """The scan of a JPEG of standard Huffman tables, behind its quantisation tables."""
    tables, position = b"", 2
    while jpeg[position + 1] != 0xDA:
        length = struct.unpack_from(">H", jpeg, position + 2)[0]
        if jpeg[position + 1] == 0xDB:
            segment = jpeg[position + 4 : position + 2 + length]
            tables += b"".join(segment[at + 1 : at + 65] for at in range(0, len(segment), 65))
        position += 2 + length
    scan = jpeg[position + 2 + struct.unpack_from(">H", jpeg, position + 2)[0] : -2]
    head = struct.pack(">IBBBB", 0, 1, 255, SIZE[0] // 8, SIZE[1] // 8)
    return head + struct.pack(">BBH", 0, 0, len(tables)) + tables + scan
