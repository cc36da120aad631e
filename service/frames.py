"""Is this upload a whole picture of the right size? Answered from its bytes, before anything decodes it.

JPEG: ITU-T T.81, annex B. PNG: ISO/IEC 15948, clause 5. Decoders are lenient where a calibration must not be: OpenCV
fills the missing part of a truncated JPEG with grey and says nothing.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Iterator, Mapping

import imagesize

from service.problems import Problem
from service.schemas import Camera, Venue
from service.settings import Settings

JPEG_START = b"\xff\xd8\xff"
PNG_START = b"\x89PNG\r\n\x1a\n"
# A marker inside entropy-coded data: FF and neither a stuffed 00, nor a restart (D0 to D7), nor a fill byte FF.
JPEG_MARKER = re.compile(rb"\xff([^\x00\xd0-\xd7\xff])")
JPEG_END, JPEG_SCAN = 0xD9, 0xDA


def check_cameras(venue: Venue, counts: Mapping[str, int], settings: Settings) -> None:
    """Every camera of the venue has frames, not too many, and no other camera has."""
    ids = [camera.id for camera in venue.cameras]
    for name in counts:
        if name not in ids:
            raise Problem(
                "unknown-camera",
                f"Venue {venue.id} has the cameras {', '.join(ids)}; name each file part by its camera.",
                camera=name[:64],
                expected=ids,
            )
    for camera in ids:
        if not counts.get(camera):
            raise Problem("missing-camera", f"Send at least one frame of camera {camera}.", camera=camera, expected=ids)
        if counts[camera] > settings.max_frames_per_camera:
            raise Problem(
                "too-many-frames",
                f"Send at most {settings.max_frames_per_camera} frames of camera {camera}.",
                camera=camera,
                expected=settings.max_frames_per_camera,
                got=counts[camera],
            )


def check(camera: Camera, data: bytes, settings: Settings) -> None:
    """One frame: an entire JPEG or PNG of the camera's size."""
    if not data:
        raise Problem(
            "empty-frame", f"The file of camera {camera.id} is empty; was it still being written?", camera=camera.id
        )
    if len(data) > settings.max_frame_mb * 1e6:
        raise Problem(
            "frame-too-large",
            f"Send camera {camera.id} in at most {settings.max_frame_mb:g} MB, for instance as JPEG of quality 95.",
            camera=camera.id,
        )
    if not data.startswith((JPEG_START, PNG_START)):
        raise Problem("not-an-image", f"Send camera {camera.id} as JPEG or PNG.", camera=camera.id)
    _check_size(camera, _size(camera, data), settings)
    walk = _jpeg_ends if data.startswith(JPEG_START) else _png_ends
    try:
        ends = walk(data)
    except (struct.error, IndexError, ValueError) as error:
        raise Problem(
            "broken-image", f"The file of camera {camera.id} is damaged; grab it again.", camera=camera.id
        ) from error
    if not ends:
        raise Problem(
            "truncated-image",
            f"The file of camera {camera.id} ends before its picture does; was it still being written?",
            camera=camera.id,
        )


def _size(camera: Camera, data: bytes) -> tuple[int, int]:
    try:
        size = imagesize.get(io.BytesIO(data))
    except Exception:  # a parser of hostile bytes, which may fail in any way
        size = (-1, -1)
    if min(size) <= 0:
        raise Problem(
            "broken-image", f"The file of camera {camera.id} does not say its size; grab it again.", camera=camera.id
        )
    return int(size[0]), int(size[1])


def _check_size(camera: Camera, size: tuple[int, int], settings: Settings) -> None:
    (width, height), wanted = size, camera.image_size
    if width * height > settings.max_frame_pixels:
        raise Problem(
            "too-many-pixels",
            f"The frame of camera {camera.id} has {width}x{height} pixels; {settings.max_frame_pixels} are allowed.",
            camera=camera.id,
            expected=wanted,
            got=[width, height],
        )
    if [width, height] != wanted:
        raise Problem(
            "frame-size",
            f"Send camera {camera.id} in {wanted[0]}x{wanted[1]} pixels, the size of its intrinsics.",
            camera=camera.id,
            expected=wanted,
            got=[width, height],
        )


def _jpeg_ends(data: bytes) -> bool:
    """Walk the segments to the end-of-image marker; whatever follows it is the camera's business."""
    position, scanned = 2, False
    while position + 1 < len(data):
        if data[position] != 0xFF:
            raise ValueError("no marker where one must be")
        marker = data[position + 1]
        if marker == 0xFF:
            position += 1
            continue
        if marker == JPEG_END:
            return scanned
        if position + 4 > len(data):
            return False
        position += 2 + struct.unpack_from(">H", data, position + 2)[0]
        if marker == JPEG_SCAN:
            scanned = True
            following = JPEG_MARKER.search(data, position)
            if following is None:
                return False
            position = following.start()
    return False


def _png_ends(data: bytes) -> bool:
    """Walk the chunks to IEND, each with a right checksum."""
    kinds = set()
    for kind in _png_chunks(data):
        kinds.add(kind)
        if kind == b"IEND":
            return b"IDAT" in kinds
    return False


def _png_chunks(data: bytes) -> Iterator[bytes]:
    position = len(PNG_START)
    while position + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        end = position + 8 + length
        if end + 4 > len(data):
            return
        if zlib.crc32(data[position + 4 : end]) != struct.unpack_from(">I", data, end)[0]:
            raise ValueError("wrong checksum")
        yield kind
        position = end + 4
