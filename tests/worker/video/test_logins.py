"""The login of a camera whose stream is tracked or stitched stays with the host that it is for."""

import http.server
import re
import threading

import pytest

from tests.worker.certificates import certificate
from tests.worker.sources.streaming_camera import ASKS, SIZE, Stranger, StreamingCamera
from worker.video.clips import Clip
from worker.video.errors import VideoError

pytestmark = pytest.mark.slow

LOGIN = "user:pass%20word"


@pytest.mark.parametrize("way", ["basic", "digest"])
@pytest.mark.parametrize("method", ["OPTIONS", "DESCRIBE", "PLAY"])
def test_a_stream_that_leads_elsewhere_is_not_followed(way, method):
    with Stranger() as stranger:
        leads = {method: f"rtsp://{stranger.host}/live?token=s3cret"}
        with StreamingCamera(way=way, leads=leads) as camera, pytest.raises(VideoError) as refused:
            Clip.open("left", f"rtsp://{LOGIN}@{camera.host}/live")
    said = str(refused.value)
    assert f"it answered 302 to {method} and leads to rtsp://{stranger.host}" in said
    assert not [secret for secret in ("s3cret", "pass%20word", "pass word") if secret in said]
    assert stranger.heard == []


def test_a_clip_by_http_that_leads_elsewhere_leaves_its_login_behind():
    heard = []

    class Host(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            heard.append((self.server.server_port, self.headers.get("Authorization")))
            leads = self.server is first and self.headers.get("Authorization")
            self.send_response(302 if leads else 401)
            self.send_header("Location", f"http://127.0.0.1:{second.server_port}/clip")
            self.send_header("WWW-Authenticate", 'Basic realm="x"')
            self.end_headers()

        def log_message(self, *_):
            pass

    first, second = (http.server.ThreadingHTTPServer(("127.0.0.1", 0), Host) for _ in range(2))
    for server in (first, second):
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    with pytest.raises(VideoError):
        Clip.open("left", f"http://{LOGIN}@127.0.0.1:{first.server_port}/clip")
    for server in (first, second):
        server.shutdown()
        server.server_close()
    assert {proof for port, proof in heard if port == second.server_port} == {None}
    assert [proof for port, proof in heard if port == first.server_port and proof]


@pytest.mark.parametrize("way", ASKS)
def test_a_stream_is_read_with_its_login(way):
    with StreamingCamera(way=way) as camera, Clip.open("left", f"rtsp://{LOGIN}@{camera.host}/live") as clip:
        assert next(clip.shots()).picture.size == SIZE
    # Cameras refuse a count that they have heard before: somebody may say again what he has overheard.
    counts = [int(count, 16) for _, proof in camera.asked for count in re.findall(r"nc=(\w+)", proof)]
    assert counts == [*range(1, len(counts) + 1)]


def test_an_encrypted_stream_needs_the_pin_that_its_refusal_shows(tmp_path):
    with StreamingCamera(certificate=certificate(tmp_path, "camera.example")) as camera:
        address = f"rtsps://{LOGIN}@{camera.host}/live"
        with pytest.raises(VideoError, match="cannot be verified") as refused:
            Clip.open("left", address)
        pin = str(refused.value).rpartition("#")[2]
        with Clip.open("left", f"{address}#{pin}") as clip:
            assert next(clip.shots()).picture.size == SIZE


@pytest.mark.parametrize(
    ("login", "pin", "words"),
    [("user:wrong", "", "it answered 401 to DESCRIBE"), (LOGIN, "#tls_sha256=1", "64 hexadecimal digits")],
)
def test_a_stream_that_cannot_be_opened_says_why(login, pin, words):
    with StreamingCamera() as camera, pytest.raises(VideoError, match=words):
        Clip.open("left", f"rtsp://{login}@{camera.host}/live{pin}")
