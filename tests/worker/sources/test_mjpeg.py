"""The first picture of an endless row of them, however the pieces of the body are cut."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from worker.sources.mjpeg import LONGEST_HEAD, FirstPart, NotMultipartError

PICTURE = b"\xff\xd8\r\n--not-the-end\r\n\xff\xd9"


def part(picture: bytes, *, length: bool, delimiter: bytes = b"--frame", line_end: bytes = b"\r\n") -> bytes:
    head = [delimiter, b"Content-Type: image/jpeg"]
    if length:
        head.append(b"content-length: %d" % len(picture))
    return line_end.join([*head, b"", picture]) + line_end


def first(body: bytes, size: int) -> bytes | None:
    found = FirstPart()
    pieces = (body[at : at + size] for at in range(0, len(body), size))
    return next((whole for piece in pieces if (whole := found.feed(piece)) is not None), None)


@given(st.integers(1, 200), st.booleans(), st.sampled_from([b"\r\n", b"\n"]), st.sampled_from([b"--frame", b"----x"]))
def test_the_first_part_is_found_however_the_body_is_cut(size, length, line_end, delimiter):
    each = [part(picture, length=length, delimiter=delimiter, line_end=line_end) for picture in (PICTURE, b"later")]
    assert first(b"".join(each), size) == PICTURE


@pytest.mark.parametrize("length", [True, False])
def test_a_part_that_is_not_whole_is_not_taken(length):
    body = part(PICTURE, length=length)
    cut = body[: -len(b"\r\n") - 1] if length else body
    assert first(cut, 7) is None


@pytest.mark.parametrize("length", [True, False])
def test_empty_parts_are_passed_over(length):
    assert first(part(b"", length=length) + part(PICTURE, length=length) + b"--frame", 5) == PICTURE


def test_a_body_without_parts_is_given_up():
    with pytest.raises(NotMultipartError):
        first(bytes(2 * LONGEST_HEAD), 1000)
