"""Checks of uploaded pictures from their bytes, before anything decodes them: whole, and of the right size.

JPEG: ITU-T T.81, annex B. PNG: ISO/IEC 15948, clause 5. Decoders are lenient where a calibration must not be: OpenCV
fills the missing part of a truncated JPEG with grey and says nothing. Sizes are read here and not by a package: those
turn them by the EXIF orientation, and what the calibration sees is not turned.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from service.schemas.file_kinds import JPEG_SCAN, JPEG_START, PNG_START, jpeg_begins_at, jpeg_segments, kind_of_file
from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.frame_sizes import is_resized, other_shape, other_size
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue

if TYPE_CHECKING:
    from service.settings import Settings

# A camera's JPEG has tens of parts, a progressive one hundreds. PNG encoders cut pixels into chunks of 4 kB and more.
# Walking a million would take seconds, in which nobody else is answered.
MOST_SEGMENTS, MOST_CHUNKS = 10_000, 50_000
# Start of frame, of all processes; C4, C8 and CC are something else.
JPEG_FRAMES = set(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


class TooManyParts(Exception):  # noqa: N818
    """Raised for a file of more parts than any encoder writes; the message says how many."""


def check_cameras(
    venue: Venue | SoughtSite, counts: Mapping[str, int], settings: Settings, needed: Collection[str] | None = None
) -> None:
    """Raise a problem unless every camera has frames, not too many, and no other has; `needed`: only these must."""
    ids = [camera.id for camera in venue.cameras]
    for name in counts:
        if name not in ids:
            raise Problem(
                "unknown-camera",
                f"Venue {venue.id} has the cameras {', '.join(ids)} and no {name[:64]!r}; name each file part by its "
                "camera.",
                camera=name[:64],
                expected=ids,
            )
    for camera in ids:
        if not counts.get(camera) and (needed is None or camera in needed):
            raise Problem("missing-camera", f"Send at least one frame of camera {camera}.", camera=camera, expected=ids)
        check_count(camera, counts.get(camera, 0), settings)


def check_count(camera: str, count: int, settings: Settings) -> None:
    """Raise the problem `too-many-frames` if a camera has too many."""
    if count > settings.max_frames_per_camera:
        raise Problem(
            "too-many-frames",
            f"Send at most {settings.max_frames_per_camera} frames of camera {camera}.",
            camera=camera,
            expected=settings.max_frames_per_camera,
            got=count,
        )


class PixelBudget:
    """Limit of the pixels of all frames of one upload together: a job keeps them decoded, all at once."""

    def __init__(self, settings: Settings) -> None:
        self._most, self._pixels = settings.max_job_pixels, 0

    def spend(self, size: Sequence[int], **part: Any) -> None:
        """Count a frame; raises the problem `too-many-pixels` if the limit is exceeded."""
        self._pixels += size[0] * size[1]
        if self._pixels > self._most:
            raise Problem(
                "too-many-pixels",
                f"With this picture of {in_words(part)} the frames have {self._pixels / 1e6:.0f} million pixels "
                f"together; {self._most / 1e6:.0f} million are allowed in one job (ESC_MAX_JOB_PIXELS). Send fewer "
                "frames of each camera, or smaller ones.",
                **part,
                expected=self._most,
                got=list(size),
            )


def check(
    camera: Camera | SoughtCameraIn, data: bytes, settings: Settings, budget: PixelBudget, *, of_any_size: bool = True
) -> None:
    """Raise a problem unless a frame is an entire JPEG or PNG of the camera's size, within the budget of its job.

    `of_any_size`: frames of its shape will do, which are resized; points are clicked in pixels of its size.
    """
    size = check_whole(data, settings, camera=camera.id)
    wanted = camera.image_size
    if wanted is not None and size != wanted and not (of_any_size and is_resized(size, wanted)):
        words = other_shape(camera.id, size, wanted) if of_any_size else other_size(camera.id, size, wanted)
        raise Problem("frame-size", words, camera=camera.id, expected=wanted, got=size)
    # A frame of another size is resized to that of its camera.
    budget.spend(wanted or size, camera=camera.id)


def check_length(length: int, settings: Settings, **part: Any) -> None:
    """Raise the problem `frame-too-large` for too many bytes; `part`: the name of their `camera` or `photo`."""
    if length > settings.max_frame_mb * 1e6:
        raise Problem(
            "frame-too-large",
            f"Send {in_words(part)} in at most {settings.max_frame_mb:g} MB, for instance as JPEG of quality 95.",
            **part,
        )


def in_words(part: Mapping[str, Any]) -> str:
    """Return the name of a part of an upload, such as `camera left`."""
    return " ".join(f"{kind} {name}" for kind, name in part.items())


def check_whole(data: bytes, settings: Settings, **parts: Any) -> list[int]:
    """Return width and height of a JPEG or PNG of any size; raises a problem unless it is entire.

    `parts`: the name of its `camera` or `photo`.
    """
    subject = in_words(parts)
    if not data:
        raise Problem("empty-frame", f"The file of {subject} is empty; was it still being written?", **parts)
    check_length(len(data), settings, **parts)
    begin = jpeg_begins_at(data)
    is_jpeg = data[begin : begin + 3] == JPEG_START
    if not is_jpeg and data[: len(PNG_START)] != PNG_START:
        kind = kind_of_file(data)
        came = "" if kind is None else f" What came is {kind}."
        raise Problem("not-an-image", f"Send {subject} as JPEG or PNG.{came}", **parts)
    try:
        outline = _jpeg(data, begin) if is_jpeg else _png(data)
    except TooManyParts as error:
        raise Problem("broken-image", f"The file of {subject} has {error}; encode it again.", **parts) from None
    except (struct.error, IndexError, ValueError):
        raise Problem("broken-image", f"The file of {subject} is damaged; grab it again.", **parts) from None
    width, height = outline.size
    if width * height > settings.max_frame_pixels:
        raise Problem(
            "too-many-pixels",
            f"The picture of {subject} has {width}x{height} pixels; {settings.max_frame_pixels} are allowed.",
            **parts,
            expected=settings.max_frame_pixels,
            got=outline.size,
        )
    if not outline.whole:
        raise Problem(
            "truncated-image",
            f"The file of {subject} ends before its picture does; was it still being written?",
            **parts,
        )
    return outline.size


@dataclass(frozen=True)
class Outline:
    """Structure of a picture file: `size` (width, height) as stored, and whether the file is `whole`.

    As stored: an orientation that the camera notes in its EXIF data turns nothing, here and when it is decoded.
    """

    size: list[int]
    whole: bool


def _jpeg(data: bytes, begin: int) -> Outline:
    """Walk the segments to the end-of-image marker; cameras write what they like behind it."""
    position, size = begin + 2, None
    for number, (position, marker) in enumerate(jpeg_segments(data, begin)):
        if number >= MOST_SEGMENTS:
            raise TooManyParts(f"more than {MOST_SEGMENTS} segments")
        if marker in JPEG_FRAMES:
            if size is not None:
                raise ValueError("two frame headers")
            height, width = struct.unpack_from(">HH", data, position + 5)
            size = [width, height]
        if marker == JPEG_SCAN and size is None:
            raise ValueError("a scan of no frame")
    if not size or min(size) < 1:
        raise ValueError("no size")
    return Outline(size, data[position : position + 2] == b"\xff\xd9")


def _png(data: bytes) -> Outline:
    """Walk the chunks to IEND, each with a right checksum."""
    width, height = struct.unpack_from(">II", data, len(PNG_START) + 8)
    if data[12:16] != b"IHDR" or min(width, height) < 1:
        raise ValueError("no size")
    kinds = list(islice(_png_chunks(data), MOST_CHUNKS + 1))
    if len(kinds) > MOST_CHUNKS:
        raise TooManyParts(f"more than {MOST_CHUNKS} chunks")
    return Outline([width, height], b"IDAT" in kinds and kinds[-1] == b"IEND")


def _png_chunks(data: bytes) -> Iterator[bytes]:
    position, content = len(PNG_START), memoryview(data)
    while position + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        end = position + 8 + length
        if end + 4 > len(data):
            return
        if zlib.crc32(content[position + 4 : end]) != struct.unpack_from(">I", data, end)[0]:
            raise ValueError("wrong checksum")
        yield kind
        if kind == b"IEND":
            return
        position = end + 4
