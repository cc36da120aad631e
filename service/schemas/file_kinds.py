"""Recognition of file types by their first bytes, for messages about those that are no JPEG or PNG; parts of a JPEG."""

import re
import struct
from collections.abc import Iterator

JPEG_START = b"\xff\xd8\xff"
JPEG_BEGIN = b"\xff\xd8"
# A marker inside entropy-coded data: FF and neither a stuffed 00, nor a restart (D0 to D7), nor a fill byte FF.
JPEG_MARKER = re.compile(rb"\xff([^\x00\xd0-\xd7\xff])")
JPEG_END, JPEG_SCAN = 0xD9, 0xDA
# Bytes FF before a marker fill up, as many as there are.
NOT_FILLED = re.compile(rb"[^\xff]")
PNG_START = b"\x89PNG\r\n\x1a\n"
# ISO/IEC 14496-12, the brand of the box `ftyp`.
BRANDS = {
    b"avif": "AVIF",
    b"avis": "AVIF",
    **dict.fromkeys((b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1"), "HEIC"),
}
HEIC_HINT = "HEIC (phones take JPEG instead when set to Most compatible)"
STARTS = {
    b"GIF8": "GIF",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"%PDF": "PDF",
    b"\xff\x0a": "JPEG XL",
    b"\0\0\0\x0cJXL ": "JPEG XL",
    b"\0\0\0\x0cjP  ": "JPEG 2000",
    b"\xff\x4f\xff\x51": "JPEG 2000",
    b"\x1a\x45\xdf\xa3": "a video (Matroska or WebM)",
    b"\0\0\0\x01": "a video (raw H.264 or H.265)",
}
# Bytes that are examined: a web page may begin with comments and line breaks.
LOOKED_AT = 512


def kind_of_file(data: bytes) -> str | None:
    """Return the type of a file that is neither JPEG nor PNG, in words; None if it is unknown."""
    head = bytes(data[:LOOKED_AT])
    if head[4:8] == b"ftyp":
        brand = BRANDS.get(head[8:12], "a video (MP4)")
        return HEIC_HINT if brand == "HEIC" else brand
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "WebP"
    for start, kind in STARTS.items():
        if head.startswith(start):
            return kind
    text = head.lstrip().lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return "a web page (a login page?)"
    return "SVG" if text.startswith(b"<svg") else "XML" if text.startswith(b"<?xml") else None


def picture_media_type(data: bytes) -> str:
    """Return the media type of a file that is PNG or else JPEG."""
    return "image/png" if data.startswith(PNG_START) else "image/jpeg"


def jpeg_begins_at(data: bytes) -> int:
    """Return the offset at which the JPEG of a file begins, 0 for all other files.

    Some cameras send a line break before the file, or say twice that it begins; decoders take neither.
    """
    position = 2 if data[:2] == b"\r\n" else 0
    if data[position : position + 3] != JPEG_START:
        return 0
    return position + 2 if data[position + 2 : position + 4] == JPEG_BEGIN else position


def jpeg_segments(data: bytes, begin: int) -> Iterator[tuple[int, int]]:
    """Yield position and code of each marker of the JPEG that begins at `begin`, up to its end or that of the data.

    It ends at end-of-image after a scan. Raises `ValueError` where there is no marker but must be one (T.81, annex B).
    """
    position, scanned = begin + 2, False
    while position + 2 <= len(data):
        if data[position] != 0xFF:
            raise ValueError("no marker where one must be")
        marker = data[position + 1]
        if marker == 0xFF:
            filled = NOT_FILLED.search(data, position)
            if filled is None:
                return
            position = filled.start() - 1
            continue
        yield position, marker
        if marker == JPEG_END:
            if not scanned:
                raise ValueError("no picture")
            return
        if position + 4 > len(data):
            return
        position += 2 + struct.unpack_from(">H", data, position + 2)[0]
        if marker == JPEG_SCAN:
            scanned = True
            following = JPEG_MARKER.search(data, position)
            if following is None:
                return
            position = following.start()
