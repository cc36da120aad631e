"""Samples of OpenTrackIO in datagrams, read back by a reader of the test's own."""

from hypothesis import given
from hypothesis import strategies as st

from service.live.packets import datagrams, fletcher_16
from tests.service.live.receiving import checksum, opentrackio_sample


def test_a_sample_of_several_datagrams_is_put_together_again_in_any_order():
    sent = list(datagrams({"text": "x" * 5000}, 7))
    assert len(sent) == 4
    waiting = iter(reversed(sent))
    sequence, sample = opentrackio_sample(lambda: next(waiting))
    assert (sequence, len(sample["text"])) == (7, 5000)


def test_a_small_sample_is_one_datagram_that_says_it_is_the_last():
    (only,) = datagrams({}, 65536 + 3)
    assert only[:6] == b"OTrk\x00\x01"
    assert only[6:8] == (3).to_bytes(2, "big"), "sequence numbers begin anew"
    assert only[12:14] == (0x8000 | 2).to_bytes(2, "big")


@given(st.binary(max_size=600))
def test_the_checksum_is_fletchers(data):
    assert fletcher_16(data) == checksum(data)


def test_the_checksum_is_modulo_256():
    # Modulo 255, as in the first papers on it, both would be 0.
    assert fletcher_16(b"\xff") == 0xFFFF
    assert fletcher_16(b"\xff\x01") == 0xFF00
