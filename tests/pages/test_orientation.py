"""Pictures whose Exif says that the camera was held otherwise: browsers show their pixels as they are stored."""

import struct
import zlib

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from testbed.running import SIZE, wait_for
from tests.pages import newcomer
from tests.pages.browsing import look
from tests.pages.firefox import firefox, firefox_at

WIDTH, HEIGHT = SIZE
UPRIGHT, UPSIDE_DOWN, QUARTER_TURN = 1, 3, 6
LATER = [
    pytest.param(kind, marks=pytest.mark.long)
    for kind in ((".jpg", UPSIDE_DOWN), (".jpg", UPRIGHT), (".png", QUARTER_TURN))
]
RED_AT_LEFT = """
canvas => {
    const pixel = (x) => [...canvas.getContext("2d").getImageData(canvas.width * x, canvas.height / 2, 1, 1).data];
    return canvas.width / canvas.height > 1.3 && pixel(0.25)[0] > 200 && pixel(0.75)[0] < 50;
}
"""


def exif(orientation):
    """Exif with nothing but the orientation."""
    return b"MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 0x0112, 3, 1, orientation, 0, 0)


def turned(suffix, orientation):
    """A picture that is red at the left as it is stored, and said to be turned."""
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[:, : WIDTH // 2, 2] = 255
    file = cv2.imencode(suffix, picture)[1].tobytes()
    said = exif(orientation)
    if suffix == ".jpg":
        app0 = 4 + int.from_bytes(file[4:6])
        # Behind JFIF, with a byte of padding before its marker.
        return file[:app0] + b"\xff\xff\xe1" + struct.pack(">H", 8 + len(said)) + b"Exif\0\0" + said + file[app0:]
    header = 8 + 25
    chunk = struct.pack(">I", len(said)) + b"eXIf" + said + struct.pack(">I", zlib.crc32(b"eXIf" + said))
    return file[:header] + chunk + file[header:]


@pytest.fixture(params=[(".jpg", QUARTER_TURN), *LATER])
def file(request, tmp_path):
    suffix, orientation = request.param
    path = tmp_path / f"left{suffix}"
    path.write_bytes(turned(suffix, orientation))
    return path


@pytest.mark.parametrize(
    ("address", "chooser", "canvas"),
    [
        ("/ui/new-venue", "#frames .drop-zone input", "[data-thumb] canvas"),
        ("/ui/venues/held/calibrate", "[data-camera=left] input[type=file]", ".thumbs canvas"),
        ("/ui/venues/held/find", "[data-camera=left] input[type=file]", ".thumbs canvas"),
        ("/ui/venues/held/ignore", "[data-camera=left] input[type=file]", "[data-camera=left] canvas"),
    ],
)
def test_pages_show_and_take_a_turned_picture_as_it_is_stored(stub, visit, file, address, chooser, canvas):
    stub.venue("held")
    page = visit(stub.url, address)
    page.locator(chooser).set_input_files(file)
    wait_for(lambda: page.locator(canvas).count() == 1 and page.locator(canvas).evaluate(RED_AT_LEFT))
    expect(page.locator(".wrong:visible")).to_have_count(0)


def test_points_are_clicked_in_a_turned_picture_as_it_is_stored(stub, visit, file):
    page = visit(stub.url, "/ui/new-venue/by-hand")
    newcomer.describe_the_pitch(page)
    page.get_by_label("A frame of it").first.set_input_files(file)
    wait_for(lambda: page.locator("[data-frame]").first.evaluate(RED_AT_LEFT))


def test_the_frames_of_a_job_that_failed_are_shown_as_they_are_stored(stub, visit, file):
    stub.venue("held", "fail")
    frames = [(camera, (file.name, file.read_bytes())) for camera in ("left", "right")]
    job = stub.http.post("/venues/held/calibrate", files=frames).raise_for_status().json()["id"]
    stub.end(job)
    page = visit(stub.url, f"/ui/jobs/{job}")
    frame = look(page.get_by_role("img", name="Frame 1 of left"))
    height, width = frame.shape[:2]
    assert width > height
    # Blue, green, red.
    assert frame[height // 2, width // 4, 2] > 200
    assert frame[height // 2, 3 * width // 4, 2] < 50


def test_the_service_takes_a_turned_picture_as_it_is_stored(stub, file):
    stub.venue("held")
    frames = [(camera, (file.name, file.read_bytes())) for camera in ("left", "right")]
    stub.end(stub.http.post("/venues/held/calibrate", files=frames).raise_for_status().json()["id"])


@pytest.fixture(scope="module")
def other_browser(missing, tmp_path_factory):
    path = firefox()
    if path is None:
        missing("firefox")
    with firefox_at(path, tmp_path_factory.mktemp("firefox") / "profile") as running:
        yield running


@pytest.mark.long
def test_firefox_shows_and_takes_a_turned_picture_as_it_is_stored(stub, other_browser, file):
    stub.venue("held")
    other_browser.goto(f"{stub.url}/ui/venues/held/calibrate")
    other_browser.choose_file("[data-camera=left] input[type=file]", file)
    canvas = 'document.querySelector(".thumbs canvas")'
    wait_for(lambda: other_browser.evaluate(f"{canvas} !== null && ({RED_AT_LEFT.strip()})({canvas})"))
    assert other_browser.evaluate('[...document.querySelectorAll(".wrong")].every((one) => one.hidden)')
