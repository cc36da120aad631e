"""Files of frames and photos become pictures, a file that is damaged a failed job that names its camera."""

import struct
from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np

from service.schemas.file_kinds import JPEG_START, PNG_START, jpeg_begins_at
from service.schemas.frame_sizes import is_resized, other_shape, resized_remark
from worker.jobs.from_schemas import JobFailedError, Picture
from worker.jobs.jpeg import DamagedPictureError, decode_by_opencv, decode_jpeg

ANIMATION = {b"acTL", b"fcTL", b"fdAT"}
"""Chunks of a PNG (edition 3, 11.3.4) by which OpenCV shows an animation where other viewers show its picture."""
BIT_DEPTH_AT = 24
LARGEST_ARRAY = 1 << 40
"""Bytes, more than any machine has; what a damaged header says may be beyond what NumPy counts with."""
SENSOR_BITS = (10, 12, 14)
"""Depths of sensors whose values are written as they are into the dark end of files of 16 bits."""


def no_remark(_: str) -> None:
    """Take what is to be told of a frame where nobody is told."""


def decode_image(
    subject: str, file: bytes, *, grey: bool = False, remark: Callable[[str], None] = no_remark
) -> Picture:
    """Return the picture of a file, (H, W, 3) BGR or (H, W), as it is stored: no EXIF orientation is obeyed.

    Raises `DamagedPictureError`. `remark` is told of what was changed in the picture of the `subject`.
    """
    file = file[jpeg_begins_at(file) :]
    is_jpeg = file.startswith(JPEG_START)
    picture = decode_jpeg(file, grey=grey) if is_jpeg else _decode_png(subject, file, grey, remark)
    if picture is None:
        _require_memory(file)
        raise DamagedPictureError("it cannot be decoded")
    return picture


def decode_frames(
    camera: str,
    image_size: Sequence[int] | None,
    files: Sequence[bytes],
    remark: Callable[[str], None] = no_remark,
) -> list[Picture]:
    """Return the frames of a camera, all of one size: the camera's, or if nobody has said one, that of the first."""
    if image_size is not None:
        return [decode_frame(camera, image_size, file, remark) for file in files]
    first = decode_frame_of_any_size(camera, files[0], remark)
    return [first, *decode_frames(camera, size_of(first), files[1:], remark)]


def decode_frame(
    camera: str, image_size: Sequence[int], file: bytes, remark: Callable[[str], None] = no_remark
) -> Picture:
    """Return a BGR frame (height, width, 3) of the size of the intrinsics; `remark` is told if it was resized to it."""
    frame = decode_frame_of_any_size(camera, file, remark)
    size = size_of(frame)
    if [*size] == [*image_size]:
        return frame
    if not is_resized(size, image_size):
        raise JobFailedError("frame-size", other_shape(camera, size, image_size), camera)
    remark(resized_remark(camera, size, image_size))
    enlarged = size[0] < image_size[0]
    way = cv2.INTER_LINEAR if enlarged else cv2.INTER_AREA
    return np.asarray(cv2.resize(frame, (image_size[0], image_size[1]), interpolation=way), dtype=np.uint8)


def decode_frame_of_any_size(camera: str, file: bytes, remark: Callable[[str], None] = no_remark) -> Picture:
    """Return a BGR frame (height, width, 3) of a camera of which nobody has said a size."""
    try:
        return decode_image(f"camera {camera}", file, remark=remark)
    except DamagedPictureError as damage:
        detail = f"A frame of camera {camera} is of no use: {damage}; grab it again."
        raise JobFailedError("broken-image", detail, camera) from None


def size_of(frame: Picture) -> tuple[int, int]:
    """Return width and height of a picture."""
    height, width = frame.shape[:2]
    return width, height


def _decode_png(subject: str, file: bytes, grey: bool, remark: Callable[[str], None]) -> Picture | None:
    if b"acTL" in file[:1024]:
        file = b"".join(_without_animation(file))
    flags = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR_BGR
    if file[BIT_DEPTH_AT : BIT_DEPTH_AT + 1] != b"\x10":
        return decode_by_opencv(file, flags)
    deep = decode_by_opencv(file, flags | cv2.IMREAD_ANYDEPTH)
    if deep is None:
        return None
    brightest = int(deep.max())
    bits = next((bits for bits in SENSOR_BITS if brightest < 1 << bits), 16)
    if bits < 16:
        remark(
            f"{subject}: the brightest value is {brightest} of 65535, so its file of 16 bits was read as one of {bits}"
        )
    return np.asarray(deep >> (bits - 8), dtype=np.uint8)


def _require_memory(file: bytes) -> None:
    """Raise `MemoryError` where a picture was not decoded for lack of it, which OpenCV does not tell from damage."""
    if file.startswith(PNG_START) and len(file) > BIT_DEPTH_AT:
        width, height = struct.unpack_from(">II", file, 16)
        # Values of 16 bits, three of each pixel, which is the most that is decoded at once.
        np.empty(min(6 * width * height, LARGEST_ARRAY), np.uint8)


def _without_animation(png: bytes) -> Iterator[bytes]:
    yield PNG_START
    position = len(PNG_START)
    while position + 12 <= len(png):
        length, kind = struct.unpack_from(">I4s", png, position)
        if kind not in ANIMATION:
            yield png[position : position + 12 + length]
        position += 12 + length
