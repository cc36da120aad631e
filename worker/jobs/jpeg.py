"""A JPEG as pixels, or why it is damaged: in its scan, too, where OpenCV shows what is left and says nothing.

simplejpeg decodes with libjpeg-turbo, as OpenCV does and to the same pixels, and stops at the first warning. A damage
that leaves as many blocks as there were leads to none: hardly one in a hundred of a frame of 4K, one in ten where
pieces of a frame of 1080p are exchanged. Zeros in place of data are seen in the data. The pixels tell more than half of
the others. Blocks are coded as differences to the block before: what is lost in one makes all that follow too bright,
too dark or too colourful, and where that begins, a step runs along the edges of blocks for just one row's length.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from service.schemas.file_kinds import JPEG_SCAN, jpeg_segments

Picture = NDArray[np.uint8]

END = b"\xff\xd9"
PADDING = b"\0\r\n"
"""Bytes before the end of the picture that are none of it: hardware fills its memory, others end a line."""
ODDITY = re.compile(r"unknown JFIF|Unknown Adobe|ICC|Invalid SOS parameters|determine subsampling")
"""Messages of libjpeg (jerror.h) that are not about pixels, and the one for files that OpenCV reads and simplejpeg does
not. After any other message OpenCV shows only the part of the picture before the damage."""
ZEROS = bytes(256)
"""More than the blocks that are coded at a time have in any picture (MCU: at most 10 blocks of 64 coefficients)."""
HUFFMAN_TABLES = 0xC4
SEQUENTIAL = (0xC0, 0xC1)
"""Markers of frames that are coded in one go; in refinements of progressive ones many zeros mean "as before"."""
END_OF_BLOCK, FIRST_OF_STANDARD = 0, 1
"""Meanings of codes; cameras that send MJPEG leave out the tables of the standard (T.81, K.3.3)."""
BLOCKS = {
    "Gray": (8, 8),
    "444": (8, 8),
    "422": (16, 8),
    "420": (16, 16),
    "440": (8, 16),
    "411": (32, 8),
    "441": (8, 32),
}
"""Width and height of what is coded at a time, px, by the sampling of colours (ITU-T T.81, A.2)."""
STEP = 8
"""Grey levels that a step at the edge of blocks has to exceed: a quarter of what changes a picture visibly."""
STEP_SHARE = 0.7
"""Least share of the blocks along one row's length by which steps are more frequent than beside it, in the same two
rows. Of 120 real pictures of fields one comes to 0.62 (a board along its upper edge), and the next to 0.41."""


class DamagedPictureError(Exception):
    """The file of a picture is damaged; the message says where, for the end of a sentence."""


def decode_jpeg(file: bytes, *, grey: bool) -> Picture | None:
    """Return a JPEG as it is stored, (H, W, 3) BGR or (H, W); None if it is of a kind that OpenCV cannot read either.

    Raises `DamagedPictureError` where its picture is damaged, and does not go by the EXIF orientation.
    """
    if _is_zeroed(file):
        raise DamagedPictureError("it is damaged (zeros in place of its data)")
    picture = _decode_strictly(file, grey)
    row = None if picture is None else _shifted_from(picture, file)
    if row is not None:
        raise DamagedPictureError(f"it is damaged from row {row} on")
    return picture


def _is_zeroed(file: bytes) -> bool:
    """True if a piece of the data of a sequential JPEG is zeros that cannot be a picture.

    Zeros are the first code of a Huffman table, again and again. Where that ends a block they are flat blocks, else
    such of one coefficient in all frequencies, which no scene has.
    """
    first_codes: dict[int, int] = {}
    sequential = False
    with suppress(ValueError):
        for position, marker in jpeg_segments(file, 0):
            begin = position + 4
            end = begin - 2 + int.from_bytes(file[position + 2 : begin])
            sequential |= marker in SEQUENTIAL
            if marker == HUFFMAN_TABLES:
                first_codes |= dict(_first_codes(file[begin:end]))
            if marker == JPEG_SCAN and end - begin > 2:
                first = first_codes.get(0x10 | file[begin + 2] & 0x0F, FIRST_OF_STANDARD)
                scan = file[end : file.find(END, end)].rstrip(PADDING)
                return sequential and first != END_OF_BLOCK and ZEROS in scan
    return False


def _first_codes(part: bytes) -> Iterator[tuple[int, int]]:
    """Yield class and number of each Huffman table of a segment, and what its first code means (T.81, B.2.4.2)."""
    while len(part) > 17:
        yield part[0], part[17]
        part = part[17 + sum(part[1:17]) :]


def _decode_strictly(file: bytes, grey: bool) -> Picture | None:
    try:
        picture = simplejpeg.decode_jpeg(file, "GRAY" if grey else "BGR", strict=True)
        return np.asarray(picture[..., 0] if grey else picture, dtype=np.uint8)
    except ValueError as warning:
        words = str(warning)
    if ODDITY.search(words):
        return decode_by_opencv(file, cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR_BGR)
    coded = file[: max(file.rfind(END), 0)]
    if "extraneous bytes before marker 0xd9" in words and coded[-1:] in PADDING:
        return _decode_strictly(coded.rstrip(PADDING) + END, grey)
    raise DamagedPictureError(f"it is damaged ({words[0].lower()}{words[1:]})")


def decode_by_opencv(file: bytes, flags: int) -> Picture | None:
    """Return a picture as OpenCV reads it, None if it cannot; a camera's EXIF orientation is not obeyed."""
    try:
        picture = cv2.imdecode(np.frombuffer(file, dtype=np.uint8), flags | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if picture is None else np.asarray(picture)


def _shifted_from(picture: Picture, file: bytes) -> int | None:
    """Return the row of pixels from which on the blocks of a picture are shifted, None where they are not."""
    try:
        sampling = simplejpeg.decode_jpeg_header(file, strict=False)[3]
    except ValueError:
        return None
    if sampling not in BLOCKS:
        return None
    width, height = BLOCKS[sampling]
    rows, columns = picture.shape[0] // height - 1, picture.shape[1] // width
    if rows < 2 or columns < 8:
        return None
    steps = _steps(picture, width, height).reshape(rows * columns, -1)
    # One row's length that begins at any block, beside what is left of the two rows that it lies in.
    first = np.arange((rows - 1) * columns)
    start = first // columns * columns
    # A step straight across the picture, as bars have, counts as much from where one row's length is mostly its own.
    begins_inside = np.abs((first - start) / columns - 0.5) < STEP_SHARE / 2
    within = _counter(np.abs(steps) > STEP)
    beside = within(start, 2 * columns) - within(first, columns)
    for darker_or_brighter in (steps > STEP, steps < -STEP):
        more = (_counter(darker_or_brighter)(first, columns) - beside).max(axis=1)
        found = np.flatnonzero(begins_inside & (more >= STEP_SHARE * columns))
        if len(found):
            return int(found[0] // columns + 1) * height
    return None


def _steps(picture: Picture, width: int, height: int) -> NDArray[np.int16]:
    """Steps (rows, columns, channels) across the upper edges of blocks, beyond what goes on beside them."""
    rows, columns = np.arange(height, picture.shape[0] // height * height, height), picture.shape[1] // width

    def beside(offset: int) -> NDArray[np.int16]:
        lines = np.ascontiguousarray(picture[rows + offset, : columns * width])
        means = cv2.resize(lines, (columns, len(rows)), interpolation=cv2.INTER_AREA)
        return means.reshape(len(rows), columns, -1).astype(np.int16)

    farther_above, above, below, farther_below = (beside(offset) for offset in (-2, -1, 0, 1))
    expected = ((farther_below - below) + (above - farther_above)) // 2
    return np.asarray(below - above - expected, dtype=np.int16)


def _counter(marked: NDArray[np.bool_]) -> Callable[[NDArray[np.int_], int], NDArray[np.int_]]:
    """Return what counts the marked among so many that begin at each of some places, by channel."""
    before = np.zeros((len(marked) + 1, marked.shape[1]), dtype=int)
    np.cumsum(marked, axis=0, out=before[1:])
    return lambda first, length: before[first + length] - before[first]
