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


def check(data: bytes) -> None:
    image_checks.check(CAMERA, data, SETTINGS)


@pytest.mark.parametrize("kind", ENCODINGS)
def test_whole_frames_pass(kind):
    check(encoded(kind))


@pytest.mark.parametrize(("width", "height", "asked"), [(32, 48, True), (48, 48, False)])
def test_a_frame_with_width_and_height_exchanged_is_asked_whether_the_venue_has_them_so(width, height, asked):
    frame = cv2.imencode(".png", np.zeros((height, width, 3), dtype=np.uint8))[1].tobytes()
    with pytest.raises(Problem, match="in 48x32 pixels") as problem:
        check(frame)
    assert ("image_size exchanged?" in problem.value.detail) == asked


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
