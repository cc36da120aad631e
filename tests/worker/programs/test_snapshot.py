"""A frame of an RTSP stream, from a camera that speaks it over a real socket."""

import socket
import struct
import threading
from base64 import b64encode
from contextlib import suppress

import cv2
import numpy as np
import pytest

from service.intake.snapshots import Snapshots
from service.settings import Settings
from service.wire.problems import Problem
from service.wire.venue import VenueIn
from tests.e2e.running import venue

SIZE = (64, 48)
SDP = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=c\r\nt=0 0\r\nm=video 0 RTP/AVP 26\r\na=control:track1\r\n"


class StreamingCamera:
    """Motion JPEG by RTSP (RFC 2326) in RTP (RFC 2435), interleaved in one TCP connection, for user:pass."""

    def __init__(self, shade: int) -> None:
        frame = np.full((SIZE[1], SIZE[0], 3), shade, np.uint8)
        self._payload = _rtp_payload(cv2.imencode(".jpg", frame)[1].tobytes())
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.host = "{}:{}".format(*self._listener.getsockname())
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                threading.Thread(target=self._converse, args=(connection,), daemon=True).start()

    def _converse(self, connection: socket.socket) -> None:
        stop = threading.Event()
        with connection, suppress(OSError), connection.makefile("rb") as lines:
            while request := lines.readline():
                if request.startswith(b"$"):
                    continue
                headers = {}
                while line := lines.readline().strip():
                    name, _, value = line.decode().partition(":")
                    headers[name.lower()] = value.strip()
                self._answer(connection, request.split()[0].decode(), headers, stop)
        stop.set()

    def _answer(self, connection, method, headers, stop) -> None:
        more, body, status = {}, "", "200 OK"
        match method:
            case "OPTIONS":
                more["Public"] = "OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN"
            case "DESCRIBE" if headers.get("authorization") != f"Basic {b64encode(b'user:pass').decode()}":
                status, more = "401 Unauthorized", {"WWW-Authenticate": 'Basic realm="camera"'}
            case "DESCRIBE":
                body, more = SDP, {"Content-Type": "application/sdp"}
            case "SETUP":
                more = {"Transport": "RTP/AVP/TCP;unicast;interleaved=0-1", "Session": "1"}
            case "PLAY":
                more["Session"] = "1"
        head = {"CSeq": headers["cseq"], "Content-Length": str(len(body)), **more}
        lines = "".join(f"{name}: {value}\r\n" for name, value in head.items())
        connection.sendall(f"RTSP/1.0 {status}\r\n{lines}\r\n{body}".encode())
        if method == "PLAY":
            threading.Thread(target=self._play, args=(connection, stop), daemon=True).start()

    def _play(self, connection, stop) -> None:
        number = 0
        with suppress(OSError):
            while not stop.wait(0.04):
                packet = struct.pack(">BBHII", 0x80, 0x80 | 26, number & 0xFFFF, number * 3600, 7) + self._payload
                connection.sendall(b"$\0" + struct.pack(">H", len(packet)) + packet)
                number += 1


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


@pytest.fixture
def camera():
    camera = StreamingCamera(shade=120)
    yield camera
    camera.close()


def taken(tmp_path, url, userinfo):
    document = venue("v", cameras=("left",))
    document["cameras"][0]["source"] = url
    stored = VenueIn.model_validate(document).stored()
    settings = Settings(data=tmp_path, sources=["127.0.0.1"], source_timeout_s=60)
    return Snapshots(settings).take(stored.cameras, {"left": userinfo})["left"]


def test_a_frame_of_a_stream_is_what_the_camera_sees(camera, tmp_path):
    frame = taken(tmp_path, f"rtsp://***@{camera.host}/live", "user:pass")
    picture = cv2.imdecode(np.frombuffer(frame, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert abs(float(picture.mean()) - 120) < 3


def test_a_stream_that_is_refused_says_what_to_look_at(camera, tmp_path):
    with pytest.raises(Problem, match="check address, user and password") as refused:
        taken(tmp_path, f"rtsp://***@{camera.host}/live", "user:wrong")
    assert "wrong" not in refused.value.detail
