"""Each dialect of `dialects.toml`: the picture is taken, or the operator reads what is the matter."""

import asyncio
import gc
import socket
import tomllib
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.schemas.programs.sources import SourceTask
from tests.dialects.stub_camera import PICTURE, StubCamera
from tests.worker.certificates import certificate
from worker.duties import outbound_guard
from worker.programs import snapshot
from worker.sources.errors import CameraError
from worker.sources.http_camera import fetch_picture
from worker.sources.pictures import FirstPicture
from worker.sources.rtsp_relay import Relay

pytestmark = pytest.mark.slow

DIALECTS = tomllib.loads(Path(__file__).with_name("dialects.toml").read_text("utf-8"))
PLAIN = DIALECTS["no type"]
STREAM = DIALECTS["a stream with SHA-512-256"]
USERINFO = "user:pass%20word"
# In which nothing that comes at all has to wait for its end.
SOON_S = 20.0


def answer_of(dialect: dict, port: int) -> str:
    """What a camera gives: `picture`, `stream`, or the reason in words."""
    if dialect.get("protocol") == "rtsp":
        return described(port)
    try:
        picture = asyncio.run(soon(httpx.URL(f"http://127.0.0.1:{port}/snapshot.jpg?channel=1")))
    except CameraError as error:
        return str(error)
    return "picture" if picture == PICTURE else repr(picture[:100])


async def soon(target, addresses=("127.0.0.1",)):
    async with asyncio.timeout(SOON_S):
        return await fetch_picture(target, addresses, USERINFO, 10**8)


def described(port: int) -> str:
    """What a player hears of a camera's stream through the relay."""
    with Relay(httpx.URL(f"rtsp://127.0.0.1:{port}/live"), ["127.0.0.1"], USERINFO) as relay:
        there = httpx.URL(relay.url)
        with socket.create_connection((there.host, there.port)) as player:
            player.settimeout(SOON_S)
            player.sendall(f"DESCRIBE {relay.url} RTSP/1.0\r\nCSeq: 3\r\n\r\n".encode())
            came = b""
            while not came.endswith(b"v=0\r\n") and (piece := player.recv(65536)):
                came += piece
        return "stream" if came.startswith(b"RTSP/1.0 200 OK\r\n") else relay.why or "no reason"


@pytest.fixture
def camera():
    """Starts cameras."""
    cameras = []

    def camera(*how, **more) -> StubCamera:
        cameras.append(StubCamera(*how, **more))
        return cameras[-1]

    yield camera
    for one in cameras:
        one.close()


@pytest.mark.parametrize("name", DIALECTS)
def test_a_camera_is_understood_or_told_in_words(camera, name):
    dialect = DIALECTS[name]
    seen = camera(dialect)
    answer, expected = answer_of(dialect, seen.port), dialect["expected"]
    assert answer == expected if expected in ("picture", "stream") else expected in answer, answer
    assert "s3cret" not in answer
    assert "asks" not in dialect or len(seen.proofs) == dialect["tries"]


@pytest.mark.parametrize("asks", [False, True])
def test_a_relay_that_ends_as_a_player_comes_leaves_no_connection_open(camera, asks):
    for _ in range(20):
        with (
            Relay(httpx.URL(f"rtsp://127.0.0.1:{camera(STREAM).port}/live"), ["127.0.0.1"], USERINFO) as relay,
            socket.create_connection(("127.0.0.1", httpx.URL(relay.url).port)) as player,
        ):
            if asks:
                player.sendall(f"DESCRIBE {relay.url} RTSP/1.0\r\nCSeq: 3\r\n\r\n".encode())
    # What is open still warns now, and a warning is an error.
    gc.collect()


def test_a_host_is_tried_at_all_its_addresses(camera):
    target = httpx.URL(f"http://camera.example:{camera(PLAIN, host='127.0.0.2').port}/")
    assert asyncio.run(soon(target, ["127.0.0.1", "127.0.0.2"])) == PICTURE


def test_a_host_is_tried_at_those_addresses_alone_that_are_permitted(camera, monkeypatch):
    refused = camera(PLAIN)
    with socket.create_server(("127.0.0.2", refused.port)):
        target = httpx.URL(f"http://localhost:{refused.port}/")
        monkeypatch.setattr(outbound_guard, "look_up", lambda _: ["127.0.0.2", "127.0.0.1"])
        task = SourceTask(
            sources={}, allowed=["127.0.0.1"], folder="", seconds=SOON_S, most_bytes=10**8, most_pixels=10**8
        )
        assert snapshot._fetch(target, None, task) == PICTURE
        with pytest.raises(
            CameraError, match=r"localhost is 127\.0\.0\.2, 127\.0\.0\.1, which ESC_SOURCES does not name"
        ):
            snapshot._fetch(target, None, task.model_copy(update={"allowed": ["10.0.0.0/8"]}))
    assert len(refused.requests) == 1


@pytest.mark.parametrize(
    "path", ["/onvif-http/snapshot?Profile_1", "//Streaming/channels/1/picture", "/a;b=%2F?c=a%20b&d"]
)
def test_the_path_of_a_source_reaches_the_camera_byte_for_byte(camera, path):
    seen = camera(PLAIN)
    asyncio.run(soon(httpx.URL(f"http://127.0.0.1:{seen.port}{path}")))
    assert seen.requests[0].startswith(f"GET {path} HTTP/1.1\r\n")


def test_a_certificate_that_the_camera_signed_itself_is_taken_by_its_pin_alone(camera, tmp_path):
    seen = camera(PLAIN, certificate=certificate(tmp_path, "camera.example"))
    address = f"https://127.0.0.1:{seen.port}/"
    with pytest.raises(CameraError, match="self-signed") as refused:
        asyncio.run(soon(httpx.URL(address)))
    pin = str(refused.value).rpartition("#")[2]
    with pytest.raises(CameraError, match=f"pinned to {'0' * 64}.*{pin}"):
        asyncio.run(soon(httpx.URL(f"{address}#tls_sha256={'0' * 64}")))
    assert seen.requests == []
    assert asyncio.run(soon(httpx.URL(f"{address}#{pin}"))) == PICTURE


@given(
    st.integers(1, 5000),
    st.sampled_from([b"", b"\r\n--b\r\nContent-Type: text/plain\r\n\r\nno\r\n", b"\xff\xd8", PICTURE[:-300] + b"\n"]),
)
def test_a_picture_is_found_however_the_body_is_cut(size, before):
    body, first = before + PICTURE + b"\r\n--b\r\n" + PICTURE, FirstPicture()
    pieces = (body[at : at + size] for at in range(0, len(body), size))
    assert next(found for piece in pieces if (found := first.feed(piece)) is not None) == PICTURE


def test_the_first_whole_png_is_found_too():
    png = cv2.imencode(".png", np.zeros((20, 30), np.uint8))[1].tobytes()
    first = FirstPicture()
    assert next(found for byte in b"--b\r\n\r\n" + png + b"\r\n--b" if (found := first.feed(bytes([byte])))) == png
