"""The first whole picture in what a camera sends, whatever stands before, between and behind pictures.

Cameras disagree with their own `multipart/x-mixed-replace` and `Content-Length`: boundaries are missing, or have other
dashes than announced, parts of text come first, lengths are wrong by some bytes. A JPEG (ITU-T T.81, annex B) and a PNG
(ISO/IEC 15948, clause 5) tell by themselves where they begin and end, so nothing else is asked.
"""

import re
import struct

# At the beginning of the body or of a line: the thumbnail within another kind of picture stands elsewhere. Some cameras
# write the first marker twice.
START = re.compile(rb"(?:\A|(?<=\n))[ \t]{0,8}(?:\xff\xd8){0,8}(\xff\xd8\xff(?!\xd8)|\x89PNG\r\n\x1a\n)")
LONGEST_START = 32
PNG_START = b"\x89PNG\r\n\x1a\n"
# A marker inside entropy-coded data: FF and neither a stuffed 00, nor a restart (D0 to D7), nor a fill byte FF.
MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
# Bytes FF before a marker fill up, as many as there are.
NOT_FILLED = re.compile(rb"[^\xff]")
JPEG_START, JPEG_END, JPEG_SCAN = 0xD8, 0xD9, 0xDA


class FirstPicture:
    """Finds the first whole picture of a body that comes in pieces. `data`: all that came."""

    def __init__(self) -> None:
        self.data = bytearray()
        self._searched = 0
        self._begin: int | None = None
        # Where the walk through a picture is, and whether it is within a scan or has passed one.
        self._position = 0
        self._in_scan = self._has_scan = False

    def feed(self, piece: bytes) -> bytes | None:
        """Take the next piece of the body; return the first picture once it is whole."""
        self.data += piece
        while self._begin is not None or self._find():
            begin = self._begin or 0
            is_png = self.data.startswith(PNG_START, begin)
            is_whole = self._walk_png() if is_png else self._walk_jpeg()
            if is_whole is None:
                return None
            if is_whole:
                return bytes(self.data[begin : self._position])
            self._begin, self._searched = None, self._position
        return None

    def _find(self) -> bool:
        found = START.search(self.data, self._searched)
        if found is None:
            self._searched = max(self._searched, len(self.data) - LONGEST_START)
            return False
        self._start_at(found.start(1))
        return True

    def _start_at(self, begin: int) -> None:
        is_png = self.data.startswith(PNG_START, begin)
        self._begin, self._position = begin, begin + (len(PNG_START) if is_png else 2)
        self._in_scan = self._has_scan = False

    def _walk_jpeg(self) -> bool | None:
        """Go on to behind the last marker; True: it is there, False: this is no picture, None: more has to come."""
        data = self.data
        while True:
            if self._in_scan:
                following = MARKER.search(data, self._position)
                if following is None:
                    self._position = max(self._position, len(data) - 1)
                    return None
                self._position, self._in_scan = following.start(), False
            if self._position + 2 > len(data):
                return None
            if data[self._position] != 0xFF:
                return False
            marker = data[self._position + 1]
            if marker == 0xFF:
                filled = NOT_FILLED.search(data, self._position)
                self._position = (len(data) if filled is None else filled.start()) - 1
                if filled is None:
                    return None
            elif marker == JPEG_END:
                self._position += 2
                return self._has_scan
            elif marker == JPEG_START:
                # The picture before was cut off.
                self._start_at(self._position)
            elif self._position + 4 > len(data):
                return None
            else:
                self._position += 2 + struct.unpack_from(">H", data, self._position + 2)[0]
                self._in_scan = marker == JPEG_SCAN
                self._has_scan = self._has_scan or self._in_scan

    def _walk_png(self) -> bool | None:
        """Go on to behind the last chunk, as `_walk_jpeg` does."""
        while self._position + 12 <= len(self.data):
            length, kind = struct.unpack_from(">I4s", self.data, self._position)
            self._position += 12 + length
            if kind == b"IEND":
                return True
        return None
