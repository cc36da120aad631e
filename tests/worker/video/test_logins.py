"""The login of a camera whose stream is tracked or stitched stays with the host that it is for."""

import http.server
import json
import queue
import re
import threading

import pytest

from testbed.running import venue
from testbed.synthetic import CROWNED, pair
from tests.e2e.commands import esc_here
from tests.worker.certificates import certificate
from tests.worker.sources.streaming_camera import ASKS, SIZE, Stranger, StreamingCamera
from worker.video.clips import Clip
from worker.video.errors import VideoError
from worker.video.live_tracking import StreamTracker

pytestmark = pytest.mark.slow

LOGIN = "user:pass%20word"


@pytest.fixture
def stranger():
    stranger = Stranger()
    yield stranger
    stranger.close()


def warned_of_live(address, _):
    warnings = queue.Queue()
    tracker = StreamTracker(CROWNED, pair()[0], address, 1, print, warnings.put, print)
    tracker.start()
    try:
        return warnings.get(timeout=60)
    finally:
        tracker.stop()


def error_of_stitch(address, folder):
    (folder / "venue.json").write_text(json.dumps(venue("v", cameras=("left",))))
    made = esc_here(folder, "stitch", "venue.json", f"left={address}", "-o", "view.mp4")
    assert made.returncode == 1
    return made.stderr


@pytest.mark.parametrize("reason", [warned_of_live, error_of_stitch])
@pytest.mark.parametrize("way", ["basic", "digest"])
@pytest.mark.parametrize("method", ["OPTIONS", "DESCRIBE", "PLAY"])
def test_a_stream_that_leads_elsewhere_is_not_followed(stranger, tmp_path, reason, way, method):
    camera = StreamingCamera(way=way, leads={method: f"rtsp://{stranger.host}/live?token=s3cret"})
    said = reason(f"rtsp://{LOGIN}@{camera.host}/live", tmp_path)
    camera.close()
    assert f"it answered 302 to {method} and leads to rtsp://{stranger.host}" in " ".join(said.split())
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
    camera = StreamingCamera(way=way)
    with Clip.open("left", f"rtsp://{LOGIN}@{camera.host}/live") as clip:
        assert next(clip.shots()).picture.size == SIZE
    camera.close()
    # Cameras refuse a count that they have heard before: somebody may say again what he has overheard.
    counts = [int(count, 16) for _, proof in camera.asked for count in re.findall(r"nc=(\w+)", proof)]
    assert counts == [*range(1, len(counts) + 1)]


def test_an_encrypted_stream_needs_the_pin_that_its_refusal_shows(tmp_path):
    camera = StreamingCamera(certificate=certificate(tmp_path, "camera.example"))
    address = f"rtsps://{LOGIN}@{camera.host}/live"
    with pytest.raises(VideoError, match="cannot be verified") as refused:
        Clip.open("left", address)
    pin = str(refused.value).rpartition("#")[2]
    with Clip.open("left", f"{address}#{pin}") as clip:
        assert next(clip.shots()).picture.size == SIZE
    camera.close()


@pytest.mark.parametrize("fault", ["wrong password", "bad pin"])
def test_a_stream_that_cannot_be_opened_says_why(fault):
    camera = StreamingCamera()
    login, pin = ("user:wrong", "") if fault == "wrong password" else (LOGIN, "#tls_sha256=1")
    words = "it answered 401 to DESCRIBE" if fault == "wrong password" else "64 hexadecimal digits"
    with pytest.raises(VideoError, match=words):
        Clip.open("left", f"rtsp://{login}@{camera.host}/live{pin}")
    camera.close()
