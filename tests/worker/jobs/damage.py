"""Files of pictures that are damaged as disks, cables and cameras do it, and whole ones of many encoders."""

import struct

import cv2
import numpy as np

PIECE = 4096
SAMPLINGS = {"411": 0x411111, "420": 0x221111, "422": 0x211111, "440": 0x121111, "444": 0x111111}
# JPEG in cv2 by quality, sampling of colours, and what else encoders vary.
VARIETIES = {
    "restarts": [cv2.IMWRITE_JPEG_RST_INTERVAL, 7],
    "optimized": [cv2.IMWRITE_JPEG_OPTIMIZE, 1],
    "progressive": [cv2.IMWRITE_JPEG_PROGRESSIVE, 1],
    "plain": [],
}


def scan_of(jpeg):
    """The first and the last place of the coded data of a JPEG with one scan."""
    for position, marker, length in segments(jpeg):
        if marker == 0xDA:
            return position + 2 + length, jpeg.rindex(b"\xff\xd9")
    raise ValueError("no scan")


def segments(jpeg):
    position = 2
    while True:
        length = struct.unpack_from(">H", jpeg, position + 2)[0]
        yield position, jpeg[position + 1], length
        if jpeg[position + 1] == 0xDA:
            return
        position += 2 + length


def _flip(data, first, last, rng):
    for position in rng.integers(first, last, 60):
        data[position] ^= 1 << int(rng.integers(0, 8))


def _zero(data, first, last, rng):
    position = rng.integers(first, last - PIECE)
    data[position : position + PIECE] = bytes(PIECE)


def _cut(data, first, last, rng):
    position = rng.integers(first, last - PIECE)
    del data[position : position + PIECE]


def _exchange(data, first, last, rng):
    one = rng.integers(first, last - 2 * PIECE)
    other = rng.integers(one + PIECE, last - PIECE + 1)
    data[one : one + PIECE], data[other : other + PIECE] = (
        data[other : other + PIECE],
        data[one : one + PIECE],
    )


DAMAGES = {"flipped": _flip, "zeroed": _zero, "cut": _cut, "exchanged": _exchange}


def damage(file, kind, rng, within=None):
    """The file with a damage between two places, of a JPEG in its scan."""
    data = bytearray(file)
    DAMAGES[kind](data, *(within or scan_of(file)), rng)
    return bytes(data)


def is_visible(picture, whole):
    """Whether more than a hundredth of the pixels differ by more than 30 grey levels."""
    return (np.abs(picture.astype(int) - whole) > 30).any(axis=-1).mean() > 0.01


def whole_files(scene, qualities=(10, 60, 90, 100)):
    """Pairs of a name and a file, as encoders write them and cameras change them."""
    for quality in qualities:
        for sampling, factors in SAMPLINGS.items():
            for variety, options in VARIETIES.items():
                chosen = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, factors, *options]
                yield f"{variety} {sampling} {quality}", _jpeg(scene, chosen)
        yield f"grey {quality}", _jpeg(scene[..., 1], [cv2.IMWRITE_JPEG_QUALITY, quality])
        plain = _jpeg(scene, [cv2.IMWRITE_JPEG_QUALITY, quality])
        yield f"no tables {quality}", without_tables(plain)
        yield f"bytes behind it {quality}", plain + bytes(3000)
        yield f"fill bytes before its end {quality}", plain[:-2] + b"\xff" * 20 + plain[-2:]
        yield f"line break before its end {quality}", plain[:-2] + b"\r\n" + plain[-2:]
        yield f"odd version {quality}", plain.replace(b"JFIF\0\1", b"JFIF\0\7", 1)
        yield f"odd scan {quality}", _with_odd_scan(plain)
    yield "png", cv2.imencode(".png", scene)[1].tobytes()


def _jpeg(picture, options):
    return cv2.imencode(".jpg", picture, options)[1].tobytes()


def without_tables(jpeg):
    """As MJPEG is sent: Huffman tables are those of the standard, which nobody repeats."""
    kept = [(position, length) for position, marker, length in segments(jpeg) if marker != 0xC4]
    *headers, (scan, _) = kept
    return jpeg[:2] + b"".join(jpeg[at : at + 2 + length] for at, length in headers) + jpeg[scan:]


def _with_odd_scan(jpeg):
    """With zeros for the spectral selection, as some encoders in cameras leave them."""
    first, _ = scan_of(jpeg)
    return jpeg[: first - 3] + bytes(3) + jpeg[first:]
