import re
import time
import zlib
from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.intake import image_checks
from service.schemas.problems import Problem
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.settings import Settings

CAMERA = VenueIn.model_validate(VENUE_EXAMPLE).to_venue().cameras[0].model_copy(update={"image_size": [48, 32]})
NOISE = np.random.default_rng(1).integers(0, 255, (32, 48, 3), dtype=np.uint8)
SETTINGS = Settings()
ENCODINGS = {
    "baseline": (".jpg", []),
    "progressive": (".jpg", [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]),
    "restarts": (".jpg", [cv2.IMWRITE_JPEG_RST_INTERVAL, 1]),
    "png": (".png", []),
}


def encoded(kind: str) -> bytes:
    suffix, options = ENCODINGS[kind]
    return cv2.imencode(suffix, NOISE, options)[1].tobytes()


def check(data: bytes, **how) -> None:
    image_checks.check(CAMERA, data, SETTINGS, image_checks.PixelBudget(SETTINGS), **how)


@pytest.mark.parametrize("kind", ENCODINGS)
def test_whole_frames_pass(kind):
    check(encoded(kind))


@pytest.mark.parametrize(("width", "height", "asked"), [(32, 48, True), (48, 48, False)])
def test_a_frame_with_width_and_height_exchanged_is_asked_whether_the_venue_has_them_so(width, height, asked):
    frame = cv2.imencode(".png", np.zeros((height, width, 3), dtype=np.uint8))[1].tobytes()
    with pytest.raises(Problem, match="in 48x32 pixels") as problem:
        check(frame)
    assert ("image_size exchanged?" in problem.value.detail) == asked
    assert asked or "such as 24x16. A frame of 48x48 is of another shape" in problem.value.detail


@pytest.mark.parametrize("size", [(24, 16), (96, 64), (144, 96)])
def test_a_frame_of_the_same_shape_passes_but_where_points_were_clicked_in_it(size):
    frame = cv2.imencode(".png", np.zeros((size[1], size[0], 3), dtype=np.uint8))[1].tobytes()
    check(frame)
    with pytest.raises(Problem, match=f"in which points are clicked; this frame has {size[0]}x{size[1]}"):
        check(frame, of_any_size=False)


def test_the_frames_of_a_job_have_so_many_pixels_together():
    settings = SETTINGS.model_copy(update={"max_job_pixels": 3 * 48 * 32})
    budget = image_checks.PixelBudget(settings)
    for _ in range(3):
        image_checks.check(CAMERA, encoded("png"), settings, budget)
    with pytest.raises(Problem, match=r"With this picture of camera left .* in one job") as refused:
        image_checks.check(CAMERA, encoded("png"), settings, budget)
    assert (refused.value.kind, refused.value.parts["camera"]) == ("too-many-pixels", "left")


OTHER_KINDS = {
    "HEIC": b"\0\0\0\x24ftypheic" + bytes(60),
    "AVIF": b"\0\0\0\x20ftypavif" + bytes(60),
    "a video (MP4)": b"\0\0\0\x20ftypisom" + bytes(60),
    "WebP": b"RIFF\x24\0\0\0WEBPVP8 " + bytes(60),
    "TIFF": b"II*\0" + bytes(60),
    "GIF": b"GIF89a" + bytes(60),
    "SVG": b" <svg xmlns='x'/>",
    "a web page": b"\r\n<!DOCTYPE html><title>Login</title>",
}


@pytest.mark.parametrize("kind", OTHER_KINDS)
def test_a_file_of_another_kind_is_told_by_name(kind):
    with pytest.raises(Problem, match=re.escape(f"as JPEG or PNG. What came is {kind}")) as refused:
        check(OTHER_KINDS[kind])
    assert refused.value.kind == "not-an-image"


@pytest.mark.parametrize("before", [b"\r\n", b"\xff\xd8", b"\r\n\xff\xd8"])
def test_what_some_cameras_send_before_a_jpeg_does_not_matter(before):
    whole = before + encoded("baseline")
    check(whole)
    for length in range(len(before), len(whole)):
        with pytest.raises(Problem):
            check(whole[:length])


@pytest.mark.parametrize("kind", ENCODINGS)
def test_bytes_after_the_end_do_not_matter(kind):
    check(encoded(kind) + b"what a camera adds")


@pytest.mark.parametrize("kind", ENCODINGS)
def test_no_frame_passes_that_was_cut_anywhere(kind):
    whole = encoded(kind)
    for length in range(len(whole)):
        with pytest.raises(Problem):
            check(whole[:length])


def test_a_preview_inside_a_jpeg_does_not_end_it():
    whole = encoded("baseline")
    preview = b"\xff\xe1" + (2 + len(whole)).to_bytes(2, "big") + whole
    assert len(whole) < 60_000
    check(whole[:2] + preview + whole[2:])
    with pytest.raises(Problem, match="ends before"):
        check(whole[:2] + preview + whole[2:-2])


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_the_orientation_in_the_exif_data_turns_nothing(orientation):
    exif = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0%c\0\0\0\0\0\0" % orientation
    whole = encoded("baseline")
    check(whole[:2] + exif + whole[2:])


@given(st.binary(max_size=300), st.sampled_from(sorted(ENCODINGS)), st.integers(0, 400))
def test_whatever_comes_a_problem_is_the_worst(garbage, kind, position):
    whole = encoded(kind)
    for data in (garbage, whole[:position] + garbage + whole[position:], whole[: position + 3] + garbage):
        with suppress(Problem):
            check(data)


def segments(count: int, segment: bytes) -> bytes:
    """A JPEG with so many of a segment before its picture."""
    whole = encoded("baseline")
    return whole[:2] + count * segment + whole[2:]


def chunked(count: int) -> bytes:
    """A PNG with so many empty comments."""
    whole = encoded("png")
    chunk = b"\0\0\0\0tEXt" + zlib.crc32(b"tEXt").to_bytes(4, "big")
    return whole[:33] + count * chunk + whole[33:]


COMMENT, SCAN = b"\xff\xfe\0\x02", b"\xff\xda\0\x02"
SMALL_PARTS = {
    "comments": (lambda: segments(10_000_000, COMMENT), "more than 10000 segments"),
    "scans": (lambda: encoded("baseline")[:-2] + 10_000_000 * SCAN + b"\xff\xd9", "more than 10000 segments"),
    "chunks": (lambda: chunked(3_000_000), "more than 50000 chunks"),
}


@pytest.mark.parametrize("kind", SMALL_PARTS)
def test_a_file_of_a_million_small_parts_is_refused_in_no_time(kind):
    make, why = SMALL_PARTS[kind]
    data = make()
    begun = time.process_time()
    with pytest.raises(Problem, match=why) as refused:
        check(data)
    assert refused.value.kind == "broken-image"
    assert time.process_time() - begun < 0.5


def test_forty_megabytes_of_fill_bytes_are_passed_over_in_no_time():
    data = segments(1, b"\xff" * 40_000_000)
    begun = time.process_time()
    check(data)
    assert time.process_time() - begun < 1


def test_as_many_parts_as_encoders_write_pass():
    check(segments(500, COMMENT))
    check(chunked(10_000))
