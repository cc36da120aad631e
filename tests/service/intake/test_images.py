from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.intake import images
from service.settings import Settings
from service.wire.problems import Problem
from service.wire.venue import VENUE_EXAMPLE, VenueIn

CAMERA = VenueIn.model_validate(VENUE_EXAMPLE).stored().cameras[0].model_copy(update={"image_size": [48, 32]})
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
    images.check(CAMERA, data, SETTINGS)


@pytest.mark.parametrize("kind", ENCODINGS)
def test_whole_frames_pass(kind):
    check(encoded(kind))


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
