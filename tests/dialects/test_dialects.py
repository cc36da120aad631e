"""Each dialect of `dialects.toml`: the picture is taken, or the operator reads what is the matter."""

import asyncio
import socket
import tomllib
from pathlib import Path

import httpx
import pytest

from tests.dialects.stub_camera import PICTURE, StubCamera
from worker.sources.errors import CameraError
from worker.sources.http_camera import fetch_picture
from worker.sources.rtsp_relay import Relay

DIALECTS = tomllib.loads(Path(__file__).with_name("dialects.toml").read_text("utf-8"))
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


@pytest.mark.parametrize("name", DIALECTS)
def test_a_camera_is_understood_or_told_in_words(name):
    dialect = DIALECTS[name]
    camera = StubCamera(dialect)
    try:
        answer = answer_of(dialect, camera.port)
    finally:
        camera.close()
    assert answer == dialect["expected"] or (dialect["expected"] in answer and len(dialect["expected"]) > 9), answer
    assert "s3cret" not in answer
    assert "asks" not in dialect or len(camera.proofs) == dialect["tries"]


def test_a_host_is_tried_at_all_its_addresses():
    camera = StubCamera(DIALECTS["no type"], "127.0.0.2")
    try:
        target = httpx.URL(f"http://camera.example:{camera.port}/")
        assert asyncio.run(soon(target, ["127.0.0.1", "127.0.0.2"])) == PICTURE
    finally:
        camera.close()
