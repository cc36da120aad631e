"""Bad uploads: the answer names the camera and what to do, and the service goes on."""

import json
import re
import socket
import struct
import subprocess
import sys
import zlib

import cv2
import httpx
import numpy as np
import pytest

from testbed.parameters import try_first
from testbed.running import SIZE, png, png_of, upload, wait_for
from tests.problems import problem_of


@pytest.fixture
def stadium(service):
    return service.venue("stadium")


@pytest.fixture
def send(service, stadium):
    def send(left, right=None, name="left.jpg"):
        files = [("left", (name, left)), ("right", ("right.png", png() if right is None else right))]
        return service.http.post(f"/venues/{stadium}/calibrate", files=files)

    return send


def jpeg() -> bytes:
    noise = np.random.default_rng(1).integers(0, 255, (SIZE[1], SIZE[0], 3), dtype=np.uint8)
    return cv2.imencode(".jpg", noise)[1].tobytes()


def bomb() -> bytes:
    """20000 x 20000 pixels in 2 kB: a bit per pixel, and few rows of them."""
    return png_of(struct.pack(">IIBBBBB", 20000, 20000, 1, 0, 0, 0, 0), zlib.compress(b"\0" * 2_000_000, 9))


def png_with(size: tuple[int, int], chunk: bytes) -> bytes:
    """A PNG of a size that says more than its pixels."""
    start = png(*size)
    kind, data = chunk[:4], chunk[4:]
    extra = struct.pack(">I", len(data)) + chunk + struct.pack(">I", zlib.crc32(kind + data))
    return start[:33] + extra + start[33:]


def jpeg_that_claims(width: int, height: int) -> bytes:
    """A small JPEG whose header speaks of a large one."""
    data = jpeg()
    frame = data.index(b"\xff\xc0")
    return data[: frame + 5] + struct.pack(">HH", height, width) + data[frame + 9 :]


SVG = b'<svg xmlns="http://www.w3.org/2000/svg"><script>alert(1)</script></svg>'
GIF = b"GIF89a" + struct.pack("<HH", *SIZE) + b"\0\0\0;"

HOSTILE = {
    "wrong size": (png(*reversed(SIZE)), "frame-size"),
    "no image": (b"once upon a time", "not-an-image"),
    "nothing": (b"", "empty-frame"),
    "truncated jpeg": (jpeg()[:-200], "truncated-image"),
    "damaged png": (png()[:60] + b"\0\0" + png()[62:], "broken-image"),
    "half a jpeg header": (jpeg()[:30], "broken-image"),
    "pixel bomb": (bomb(), "too-many-pixels"),
    "pixel bomb as jpeg": (jpeg_that_claims(65535, 65535), "too-many-pixels"),
    "no pixels": (png_of(struct.pack(">IIBBBBB", 0, 0, 8, 0, 0, 0, 0), zlib.compress(b"")), "broken-image"),
    "no pixels as jpeg": (jpeg_that_claims(0, 0), "broken-image"),
    "gif that ends as a jpeg": (GIF + jpeg(), "not-an-image"),
    "a page before the picture": (b"<html>" + png(), "not-an-image"),
    "a chunk of two gigabytes": (png()[:33] + struct.pack(">I4s", 2**31 - 1, b"IDAT") + b"x", "truncated-image"),
    "a jpeg of markers": (b"\xff\xd8" + b"\xff" * 100_000, "broken-image"),
    "a jpeg of frames": (jpeg()[:-2] + jpeg()[2:], "broken-image"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_bad_frame_is_refused_by_the_name_of_its_camera(send, kind):
    data, problem = HOSTILE[kind]
    answer = send(data)
    assert answer.status_code in (413, 422)
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == f"/problems/{problem}"
    assert answer.json()["camera"] == "left"
    assert "left" in answer.json()["detail"]


def test_a_wrong_size_says_what_was_expected_and_what_came(send):
    problem = send(png(32, 40)).json()
    assert (problem["expected"], problem["got"]) == (list(SIZE), [32, 40])


def test_a_frame_may_have_as_many_bytes_as_the_setting_says(unusual, name):
    unusual.venue(name)
    too_large = unusual.http.post(f"/venues/{name}/calibrate", files=[("left", ("l", jpeg())), *upload()[1:]])
    assert problem_of(too_large) == (413, "frame-too-large")
    body = unusual.http.post(f"/venues/{name}/calibrate", files=[("left", ("l", bytes(50_000)))])
    assert problem_of(body) == (413, "body-too-large")

    def chunks():
        yield from [bytes(1000)] * 50

    chunked = unusual.http.put(f"/venues/{name}", content=chunks(), headers={"Content-Type": "application/json"})
    assert problem_of(chunked) == (413, "body-too-large")


def test_a_missing_camera_is_named(service, stadium):
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=upload(cameras=("left",)))
    assert problem_of(answer) == (422, "missing-camera")
    assert answer.json()["camera"] == "right"


@pytest.mark.parametrize("camera", ["middle", "../../etc/passwd", "left ", "LEFT", "a" * 500, "\u2028", ""])
def test_an_unknown_camera_is_named(service, stadium, camera):
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=[*upload(), (camera, ("x.png", png()))])
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/unknown-camera"
    assert repr(camera[:64]) in answer.json()["detail"]


def test_too_many_frames_of_a_camera_are_refused(service, stadium):
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=[upload()[1]] + [upload()[0]] * 17)
    assert problem_of(answer) == (422, "too-many-frames")


def test_a_frame_that_is_no_file_is_refused(service, stadium):
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=[*upload()[1:], ("left", (None, "left.jpg"))])
    assert problem_of(answer) == (422, "not-a-file")


@pytest.mark.parametrize("file_name", ["../../../../etc/cron.d/x", "/etc/passwd", "a\\b\\c", "x" * 500, "\u202e.png"])
def test_the_name_of_a_file_means_nothing(send, service, file_name):
    answer = send(png(shade=77), name=file_name)
    assert answer.status_code in (200, 202)
    service.end(answer.json()["id"])


@pytest.mark.parametrize(
    "options",
    [
        "{",
        "[]",
        "null",
        '"text"',
        '{"generations": 0}',
        '{"generations": 1e9}',
        '{"seed": -1}',
        '{"seed": 1.5}',
        '{"seed": "7"}',
        '{"stitch_weight": NaN}',
        '{"stitch_weight": 2}',
        '{"timeout_s": Infinity}',
        '{"flat": "yes"}',
        '{"preset": "other"}',
        '{"priority": "now"}',
        '{"unknown": 1}',
        "[" * 60_000,
        '{"seed": ' + "9" * 5000 + "}",
        '{"\\ud800": 1}',
    ],
)
def test_garbage_in_the_options_is_refused(service, stadium, options):
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=[*upload(), ("options", (None, options))])
    assert problem_of(answer) == (422, "invalid-request")


def test_options_may_come_as_a_file_but_once(service, stadium):
    options = ("options", ("o.json", b'{"generation": 1}'))
    answer = service.http.post(f"/venues/{stadium}/calibrate", files=[*upload(), options])
    assert answer.json()["errors"] == [
        {"where": "options.generation", "message": "generation is not known; did you mean generations?"}
    ]
    assert service.http.post(f"/venues/{stadium}/calibrate", files=[*upload(), options, options]).status_code == 422


def test_what_is_no_form_is_refused(service, stadium):
    url = f"/venues/{stadium}/calibrate"
    assert service.http.post(url, json={}).json()["type"] == "/problems/not-multipart"
    assert service.http.post(url).json()["type"] == "/problems/missing-camera"
    no_boundary = service.http.post(url, content=b"x", headers={"Content-Type": "multipart/form-data"})
    assert no_boundary.json()["type"] == "/problems/malformed-request"
    torn = {"Content-Type": "multipart/form-data; boundary=x"}
    part = b'--x\r\nContent-Disposition: form-data; name="left"; filename="l"\r\n\r\nabc'
    assert service.http.post(url, content=part, headers=torn).status_code in (400, 422)


def test_frames_for_no_venue_are_refused(service):
    answer = service.http.post("/venues/nowhere/calibrate", files=upload())
    assert problem_of(answer) == (404, "venue-not-found")


def test_refused_frames_leave_nothing_behind(service, send):
    before = sorted(service.data.glob("blobs/frames/*"))
    assert send(png(), right=b"no").json()["camera"] == "right"
    assert sorted(service.data.glob("blobs/frames/*")) == before


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"),
        ("GET", "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/events"),
        ("POST", "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/cancel"),
        ("GET", "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/preview.jpg"),
        ("GET", "/jobs/..%2f..%2fetc"),
        ("GET", "/jobs/x"),
        ("GET", "/jobs?cursor=%00"),
        ("GET", "/jobs?limit=1e9"),
        ("GET", "/jobs?venue=%ff"),
        ("GET", "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D?%cb=1"),
        ("GET", "/venues/%00"),
        ("GET", "/venues/UPPER"),
        ("PATCH", "/venues"),
        ("GET", "/nowhere"),
        ("GET", "/problems/none"),
    ],
)
def test_whatever_is_asked_a_problem_answers(service, method, path):
    answer = service.http.request(method, path)
    assert answer.status_code in (404, 405, 422)
    assert answer.headers["content-type"] == "application/problem+json"
    assert set(answer.json()) >= {"type", "title", "status", "detail"}


def test_every_kind_of_problem_is_explained(service):
    type_ = service.http.get("/nowhere").json()["type"]
    assert service.http.get(type_).json()["title"] == "There is nothing at this address"


def test_every_reason_for_a_refusal_is_explained(service):
    answer = service.http.get("/refusals/residual").json()
    assert answer["document"] == "docs/refused.md#the-lines"
    assert service.http.get("/refusals/whim").status_code == 404


def test_after_all_this_the_service_is_there_and_has_made_no_mistake(service):
    assert service.http.get("/readyz").status_code == 200
    assert "Traceback" not in (service.data / "log").read_text()
    assert 'status="500"' not in service.http.get("/metrics").text


def test_the_interface_describes_itself(service):
    text = service.http.get("/openapi.json").text
    document = json.loads(text)
    schemas = document["components"]["schemas"]
    assert "/venues/{venue_id}/calibrate" in document["paths"]
    assert {ref.rpartition("/")[2] for ref in re.findall(r'"\$ref":"([^"]+)"', text)} <= set(schemas)
    assert all("examples" in schemas[name] for name in ("VenueIn", "Options", "Job", "ProblemDetails"))
    assert service.http.get("/docs").status_code == 200


def test_an_upload_that_breaks_off_is_no_mistake_of_the_service(service, stadium):
    url, log = httpx.URL(service.url), service.data / "log"
    before = len(log.read_text())
    with socket.create_connection((url.host, url.port)) as connection:
        head = f"POST /venues/{stadium}/calibrate HTTP/1.1\r\nHost: x\r\nContent-Length: 5000\r\n"
        connection.sendall(head.encode() + b"Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n")
    # Other things that the service does may be told after it.
    wait_for(lambda: f"/venues/{stadium}/calibrate" in log.read_text()[before:])
    assert "Traceback" not in log.read_text()


# Made when they are asked for: 100 MB take their time.
MORE_THAN_A_PICTURE = {
    "a page behind it": lambda: png(shade=41) + SVG,
    "a megabyte behind it": lambda: png(shade=42) + bytes(1_000_000),
    "100 MB of text in it": lambda: png_with(SIZE, b"zTXtbomb\0\0" + zlib.compress(bytes(100_000_000))),
    "100 MB of pixels in it": lambda: png_of(
        struct.pack(">IIBBBBB", *SIZE, 8, 0, 0, 0, 0), zlib.compress(bytes(100_000_000))
    ),
}
DECODE = """
import cv2, numpy, re, sys
for path in sys.argv[1:]:
    frame = cv2.imdecode(numpy.fromfile(path, numpy.uint8), cv2.IMREAD_COLOR_BGR)
    print(frame.shape[1], frame.shape[0], re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])
"""


@pytest.mark.parametrize("kind", try_first(MORE_THAN_A_PICTURE, 2))
def test_a_picture_with_more_in_it_is_taken_for_the_picture(service, send, kind):
    answer = send(MORE_THAN_A_PICTURE[kind]())
    assert answer.status_code == 202, answer.text
    assert service.end(answer.json()["id"])["status"] == "succeeded"


def test_decoding_it_takes_no_more_room_than_its_pixels(tmp_path):
    pictures = [tmp_path / str(number) for number in range(1 + len(MORE_THAN_A_PICTURE))]
    for path, made in zip(pictures, (png, *MORE_THAN_A_PICTURE.values()), strict=True):
        path.write_bytes(made())
    said = subprocess.run([sys.executable, "-c", DECODE, *pictures], capture_output=True, text=True, check=True).stdout
    (_, usual_kb), *peaks = [(tuple(map(int, size)), int(kb)) for *size, kb in map(str.split, said.splitlines())]
    for size, peak_kb in peaks:
        assert size == SIZE
        assert peak_kb < usual_kb + 20_000
