"""A frame of an RTSP stream, from cameras that speak it over real sockets."""

import re
import socket
import subprocess
import sys
from base64 import b64encode
from fractions import Fraction

import av
import cv2
import httpx
import numpy as np
import pytest

from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.programs.sources import SourceTask
from service.schemas.venue import VenueIn
from service.settings import Settings
from testbed.parameters import try_first
from testbed.running import venue
from tests.listener import Parrot
from tests.worker.certificates import certificate
from tests.worker.receiver import TELLTALE
from tests.worker.sources.streaming_camera import ASKS, SIZE, Film, Stranger, StreamingCamera
from worker.programs import snapshot
from worker.sources.errors import CameraError
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


@pytest.mark.parametrize("way", try_first(ASKS, 2))
def test_a_frame_of_a_stream_is_what_the_camera_sees(camera, tmp_path, way):
    seen = camera(shade=120, way=way)
    frame = taken(tmp_path, f"rtsp://***@{seen.host}/live?channel=1", RIGHT)
    picture = cv2.imdecode(np.frombuffer(frame, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert abs(float(picture.mean()) - 120) < 3
    if way != "basic":
        assert not [given for _, given in seen.asked if given.startswith("Basic")]


def test_a_camera_that_signed_its_own_certificate_is_taken_from_by_the_pin_that_its_refusal_shows(camera, tmp_path):
    seen = camera(certificate=certificate(tmp_path, "camera.example"))
    said = refused(tmp_path, f"rtsps://***@{seen.host}/live", RIGHT)
    pin = re.search("#tls_sha256=[0-9a-f]{64}", said)[0]
    assert "cannot be verified (self-signed certificate)" in said
    assert seen.asked == []
    assert taken(tmp_path, f"rtsps://***@{seen.host}/live{pin}", RIGHT)
    name, _, digits = pin.partition("=")
    as_cameras_show_it = ":".join(re.findall("..", digits.upper()))
    assert taken(tmp_path, f"rtsps://***@{seen.host}/live{name}={as_cameras_show_it}", RIGHT)
    asked = len(seen.asked)
    assert pin in refused(tmp_path, f"rtsps://***@{seen.host}/live#tls_sha256={'0' * 64}", RIGHT)
    assert len(seen.asked) == asked


def test_a_stream_that_is_refused_says_what_to_look_at(camera, tmp_path):
    said = refused(tmp_path, f"rtsp://***@{camera().host}/live", "user:wrong")
    assert "it answered 401 to DESCRIBE; check address, user and password" in said
    assert "wrong" not in said


def test_a_user_and_password_that_are_wrong_are_tried_once(camera, tmp_path):
    seen = camera(way="digest")
    refused(tmp_path, f"rtsp://***@{seen.host}/live", "user:wrong")
    assert len([given for method, given in seen.asked if method == "DESCRIBE" and given]) == 1


@pytest.mark.parametrize("way", try_first(["digest", "basic"]))
@pytest.mark.parametrize("method", ["OPTIONS", "DESCRIBE", "SETUP", "PLAY"])
def test_a_camera_that_leads_elsewhere_is_not_followed_and_its_password_stays_with_it(camera, tmp_path, method, way):
    with Stranger() as stranger:
        seen = camera(way=way, leads={method: f"rtsp://{stranger.host}/live?token=s3cret"})
        said = refused(tmp_path, f"rtsp://***@{seen.host}/live", RIGHT)
    assert f"it answered 302 to {method} and leads to rtsp://{stranger.host}, which is not followed" in said
    assert "s3cret" not in said
    assert stranger.heard == []


def test_nobody_else_on_the_machine_speaks_to_the_camera_through_the_relay(camera):
    seen = camera()
    target = httpx.URL(f"rtsp://{seen.host}/live")
    with Relay(target, ["127.0.0.1"], RIGHT) as relay:
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
    ("says", "words"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "it speaks HTTP at this address"),
        (b"RTSP/1.0 x\r\nCSeq: 1\r\n\r\n", "neither RTSP nor HTTP"),
        (b"A" * 200_000, "its head has no end"),
    ],
)
def test_what_does_not_speak_rtsp_is_called_so(tmp_path, says, words):
    with Parrot(says) as listener:
        assert words in refused(tmp_path, f"rtsp://{listener.host}/live", None)


def test_the_program_loads_no_models_of_venues_and_results():
    """Every fetch starts it anew."""
    modules = "import sys, worker.programs.snapshot; print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", modules], capture_output=True, text=True, check=True)
    assert "service.schemas.programs.sources" in told.stdout.split()
    assert not {"service.intake", "service.schemas.venue", "service.schemas.results"} & set(told.stdout.split())


def encoded(codec, rate=25, frames=120, **options) -> list[bytes]:
    """Pictures of a noisy ground over which a bar goes, encoded; each has it a pixel further."""
    context = av.CodecContext.create(codec, "w")
    context.width, context.height = GROUND.shape[1::-1]
    context.pix_fmt, context.time_base, context.framerate, context.bit_rate = "yuv420p", Fraction(1, rate), rate, 10**6
    context.options = {name.replace("_", "-"): value for name, value in options.items()}
    packets = []
    for number in range(frames):
        frame = av.VideoFrame.from_ndarray(with_bar(number), format="bgr24")
        frame.pts = number
        packets += context.encode(frame)
    return [bytes(packet) for packet in [*packets, *context.encode(None)]]


def with_bar(number):
    picture = GROUND.copy()
    at = number % (SIZE[0] - 8)
    picture[:, at : at + 8] = 255
    return picture


GROUND = np.random.default_rng(1).integers(40, 200, (6, 8, 3), np.uint8).repeat(8, 0).repeat(8, 1)
# Less than a picture has.
LONGEST_PAYLOAD = 300
HEAD = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=c\r\nt=0 0\r\n"
SDP = HEAD + "m=video 0 RTP/AVP 96\r\na=rtpmap:96 {}/90000\r\na=fmtp:96 {}\r\n"


def mpeg4_film(joined_at) -> Film:
    """A stream of MPEG-4 Visual (RFC 6416) that is joined in the middle of a group of pictures."""
    pictures = encoded("mpeg4", g="50")
    config = pictures[0][: pictures[0].index(b"\0\0\1\xb6")].hex()
    cut = [
        [picture[at : at + LONGEST_PAYLOAD] for at in range(0, len(picture), LONGEST_PAYLOAD)]
        for picture in pictures[joined_at:]
    ]
    return Film(SDP.format("MP4V-ES", f"profile-level-id=1;config={config}"), 96, cut)


def refreshed_film(joined_at) -> Film:
    """A stream of H.264 (RFC 6184) without key frames but its first, which is refreshed column by column."""
    pictures = encoded("libx264", tune="zerolatency", x264_params="intra-refresh=1:keyint=40:sliced-threads=0")
    units = [[unit.rstrip(b"\0") for unit in picture.split(b"\0\0\1") if unit.strip(b"\0")] for picture in pictures]
    sets = ",".join(b64encode(unit).decode() for unit in units[0] if unit[0] & 31 in (7, 8))
    cut = [[payload for unit in picture for payload in h264_payloads(unit)] for picture in units[joined_at:]]
    return Film(SDP.format("H264", f"packetization-mode=1;sprop-parameter-sets={sets}"), 96, cut)


def h264_payloads(unit) -> list[bytes]:
    """A unit as it is, or in fragments (FU-A)."""
    if len(unit) <= LONGEST_PAYLOAD:
        return [unit]
    pieces = [unit[at : at + LONGEST_PAYLOAD] for at in range(1, len(unit), LONGEST_PAYLOAD)]
    flags = [0x80, *[0] * (len(pieces) - 2), 0x40]
    return [
        bytes([unit[0] & 0xE0 | 28, flag | unit[0] & 31]) + piece for flag, piece in zip(flags, pieces, strict=True)
    ]


@pytest.mark.parametrize("film", [mpeg4_film, refreshed_film])
def test_a_stream_that_is_joined_in_the_middle_gives_a_frame_after_it_has_become_whole(camera, tmp_path, film):
    seen = camera(film=film(joined_at=10))
    frame = taken(tmp_path, f"rtsp://***@{seen.host}/live", RIGHT)
    picture = cv2.imdecode(np.frombuffer(frame, np.uint8), cv2.IMREAD_COLOR)
    assert min(np.abs(picture.astype(int) - with_bar(number)).mean() for number in range(120)) < 8


@pytest.mark.parametrize("says", try_first(TELLTALE, 3))
@pytest.mark.parametrize("userinfo", [None, RIGHT])
def test_nothing_that_the_host_of_a_source_says_is_read_through_its_refusal(tmp_path, says, userinfo):
    # Some are read as an answer without a picture, as of a camera that writes bad heads.
    with Parrot(says) as listener, pytest.raises(Problem) as refusal:
        taken(tmp_path, f"http://{listener.host}/picture", userinfo)
    assert "hunter2" not in refusal.value.detail
    assert "bytearray" not in refusal.value.detail


def test_a_stream_that_is_given_up_is_late_and_not_one_that_cannot_be_opened(tmp_path, monkeypatch):
    monkeypatch.setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", "")
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(CameraError, match=r"no frame within 0\.2 s"):
        snapshot._fetch(httpx.URL(f"rtsp://127.0.0.1:{silent.getsockname()[1]}/live"), None, asked(tmp_path, 0.2))


def asked(folder, seconds):
    permitted = ["10.1.0.0/16", "127.0.0.1"]
    return SourceTask(
        sources={}, allowed=permitted, folder=str(folder), seconds=seconds, most_bytes=1000, most_pixels=1000
    )


def test_of_a_name_with_several_addresses_those_alone_are_called_that_are_permitted(tmp_path, monkeypatch):
    called = []

    async def fetch_picture(_, addresses, *__):
        called.extend(addresses)
        return b"a picture"

    monkeypatch.setattr(snapshot.outbound_guard, "look_up", lambda _: ["169.254.169.254", "10.1.0.7", "10.2.0.7"])
    monkeypatch.setattr(snapshot, "fetch_picture", fetch_picture)
    assert snapshot._fetch(httpx.URL("http://camera.example/left.jpg"), None, asked(tmp_path, 1.0)) == b"a picture"
    assert called == ["10.1.0.7"]
