"""A frame of an RTSP stream, from cameras that speak it over real sockets."""

import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress

import cv2
import httpx
import numpy as np
import pytest

from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.venue import VenueIn
from service.settings import Settings
from tests.e2e.running import venue
from tests.worker.certificates import certificate
from tests.worker.receiver import TELLTALE
from tests.worker.sources.streaming_camera import ASKS, SIZE, StreamingCamera
from worker.sources.rtsp_relay import Relay

pytestmark = pytest.mark.slow

RIGHT = "user:pass%20word"


@pytest.fixture
def camera():
    """Starts cameras."""
    cameras = []

    def camera(**what) -> StreamingCamera:
        cameras.append(StreamingCamera(**what))
        return cameras[-1]

    yield camera
    for one in cameras:
        one.close()


class Stranger:
    """A host that a camera leads to: keeps what is said to it."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.host = "{}:{}".format(*self._listener.getsockname())
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self.heard.append(b"a connection")
            with connection:
                connection.sendall(b'RTSP/1.0 401 Unauthorized\r\nCSeq: 1\r\nWWW-Authenticate: Basic realm="x"\r\n\r\n')
                connection.settimeout(5)
                while data := connection.recv(4096):
                    self.heard.append(data)

    def close(self) -> None:
        self._listener.close()


@pytest.fixture
def stranger():
    stranger = Stranger()
    yield stranger
    stranger.close()


def taken(tmp_path, url, userinfo):
    document = venue("v", cameras=("left",))
    document["cameras"][0]["source"] = url
    stored = VenueIn.model_validate(document).to_venue()
    settings = Settings(data=tmp_path, sources=["127.0.0.1"], source_timeout_s=60)
    known = {} if userinfo is None else {"left": userinfo}
    return Snapshots(settings, lambda _: None).take(stored.cameras[0], known)


def refused(tmp_path, url, userinfo) -> str:
    with pytest.raises(Problem) as problem:
        taken(tmp_path, url, userinfo)
    assert problem.value.kind == "source-failed"
    return problem.value.detail


@pytest.mark.parametrize("way", ASKS)
def test_a_frame_of_a_stream_is_what_the_camera_sees(camera, tmp_path, way):
    seen = camera(shade=120, way=way)
    frame = taken(tmp_path, f"rtsp://***@{seen.host}/live?channel=1", RIGHT)
    picture = cv2.imdecode(np.frombuffer(frame, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert abs(float(picture.mean()) - 120) < 3
    if way != "basic":
        assert not [given for _, given in seen.asked if given.startswith("Basic")]


def test_an_encrypted_stream_is_taken_from_a_camera_that_signed_its_own_certificate(camera, tmp_path):
    seen = camera(certificate=certificate(tmp_path, "camera.example"))
    assert taken(tmp_path, f"rtsps://***@{seen.host}/live", RIGHT)


def test_a_stream_that_is_refused_says_what_to_look_at(camera, tmp_path):
    said = refused(tmp_path, f"rtsp://***@{camera().host}/live", "user:wrong")
    assert "it answered 401 to DESCRIBE; check address, user and password" in said
    assert "wrong" not in said


def test_a_user_and_password_that_are_wrong_are_tried_once(camera, tmp_path):
    seen = camera(way="digest")
    refused(tmp_path, f"rtsp://***@{seen.host}/live", "user:wrong")
    assert len([given for method, given in seen.asked if method == "DESCRIBE" and given]) == 1


@pytest.mark.parametrize("way", ["basic", "digest"])
@pytest.mark.parametrize("method", ["OPTIONS", "DESCRIBE", "SETUP", "PLAY"])
def test_a_camera_that_leads_elsewhere_is_not_followed_and_its_password_stays_with_it(
    camera, stranger, tmp_path, method, way
):
    seen = camera(way=way, leads={method: f"rtsp://{stranger.host}/live?token=s3cret"})
    said = refused(tmp_path, f"rtsp://***@{seen.host}/live", RIGHT)
    assert f"it answered 302 to {method} and leads to rtsp://{stranger.host}, which is not followed" in said
    assert "s3cret" not in said
    assert stranger.heard == []


def test_nobody_else_on_the_machine_speaks_to_the_camera_through_the_relay(camera):
    seen = camera()
    target = httpx.URL(f"rtsp://{seen.host}/live")
    with Relay(target, ["127.0.0.1"], target.port, RIGHT) as relay:
        there = httpx.URL(relay.url)
        with socket.create_connection((there.host, there.port)) as guess:
            guess.sendall(f"OPTIONS rtsp://127.0.0.1:{there.port}/live RTSP/1.0\r\nCSeq: 1\r\n\r\n".encode())
            assert guess.recv(1) == b""
        with socket.create_connection((there.host, there.port)) as player:
            player.sendall(f"OPTIONS {relay.url} RTSP/1.0\r\nCSeq: 7\r\n\r\n".encode())
            answer = player.recv(4096).decode()
    assert answer.startswith("RTSP/1.0 200 OK")
    assert "CSeq: 7" in answer
    assert [method for method, _ in seen.asked] == ["OPTIONS"]


@pytest.mark.parametrize(
    "says", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b"RTSP/1.0 x\r\nCSeq: 1\r\n\r\n", b"A" * 200_000]
)
def test_what_does_not_speak_rtsp_is_called_so(tmp_path, says):
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def answer():
            connection, _ = listener.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(says)
                time.sleep(1)

        threading.Thread(target=answer, daemon=True).start()
        said = refused(tmp_path, "rtsp://{}:{}/live".format(*listener.getsockname()), None)
    assert "what it says is not RTSP" in said


def test_the_program_loads_no_models_of_venues_and_results():
    """Every fetch starts it anew."""
    modules = "import sys, worker.programs.snapshot; print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", modules], capture_output=True, text=True, check=True)
    assert "service.schemas.programs.sources" in told.stdout.split()
    assert not {"service.intake", "service.schemas.venue", "service.schemas.results"} & set(told.stdout.split())


@pytest.mark.parametrize("says", TELLTALE)
@pytest.mark.parametrize("userinfo", [None, RIGHT])
def test_nothing_that_the_host_of_a_source_says_is_read_through_its_refusal(tmp_path, says, userinfo):
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def answer():
            with suppress(OSError):
                while True:
                    connection, _ = listener.accept()
                    with connection:
                        connection.recv(4096)
                        connection.sendall(says)

        threading.Thread(target=answer, daemon=True).start()
        detail = refused(tmp_path, "http://{}:{}/picture".format(*listener.getsockname()), userinfo)
    assert "hunter2" not in detail
    assert "bytearray" not in detail
