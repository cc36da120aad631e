"""FreeD, message D1: 29 bytes a camera, as camera tracking sends it over serial lines and UDP.

Layout (Vinten, "Free-d"): D1, camera id, then big-endian signed 24-bit numbers: pan, tilt, roll in 1/32768 degree, X,
Y and height in 1/64 mm, zoom and focus as unsigned counts of an encoder, two spare bytes, and a checksum that makes the
sum 0x40 modulo 256. There is no lens in it: whoever reads it must have the intrinsics from elsewhere, and may look them
up by the counts, which the tables of the camera's `LensEncoders` give; without a table they are 0.

Pan is positive to the right, tilt upwards, roll clockwise from behind; a camera without any looks along y of the pitch.
Vendors differ in that: `axes` says what goes where.
"""

import math
import re
from collections.abc import Sequence

from service.formats.lens import NumberedCamera, cannot_hold
from service.formats.opentrackio import AHEAD_IS_Y, pan_tilt_roll
from service.formats.rotations import product, transposed

STEPS_PER_DEGREE = 32768
STEPS_PER_METRE = 64_000
AXIS = re.compile(r"(?P<sign>-?)(?P<name>[a-z]+)(?P<offset>[+-][0-9.]+)?")


def write(cameras: Sequence[NumberedCamera], axes: str) -> bytes:
    """Return a packet per camera, in the order of the venue; its id is the number of the camera there, from 1.

    `axes`: the values of X, Y, height, pan, tilt and roll: `x y z pan tilt roll`, or `y -x z -pan+90 tilt roll`.
    """
    return b"".join(_packet(camera, axes) for camera in cameras)


def _packet(camera: NumberedCamera, axes: str) -> bytes:
    x, y, height, pan, tilt, roll = _mapped(camera, axes)
    content = bytes([0xD1, camera.number])
    content += b"".join(_steps(camera, "degrees", value, STEPS_PER_DEGREE) for value in (pan, tilt, roll))
    content += b"".join(_steps(camera, "m", value, STEPS_PER_METRE) for value in (x, y, height))
    content += b"".join(count.to_bytes(3, "big") for count in _counts(camera)) + bytes(2)
    return content + bytes([(0x40 - sum(content)) % 256])


def _counts(camera: NumberedCamera) -> tuple[int, int]:
    """Return the counts of zoom and focus."""
    zoom, focus = (None, None) if camera.encoders is None else (camera.encoders.zoom, camera.encoders.focus)
    return (
        0 if zoom is None else zoom.count_at(zoom.focal_length_mm(camera.camera)),
        0 if focus is None else focus.count_at(focus.distance_m),
    )


def _mapped(camera: NumberedCamera, axes: str) -> list[float]:
    pan, tilt, roll = pan_tilt_roll(product(transposed(camera.rotation), transposed(AHEAD_IS_Y)))
    values = dict(zip("xyz", camera.pose.position, strict=True))
    values |= {"pan": -math.degrees(pan), "tilt": math.degrees(tilt), "roll": math.degrees(roll)}
    found = [_value(match, values) for match in AXIS.finditer(axes)]
    return found[:3] + [math.remainder(angle, 360) for angle in found[3:]]


def _value(axis: re.Match[str], values: dict[str, float]) -> float:
    value = values[axis["name"]] + 0.0
    return (-value if axis["sign"] else value) + float(axis["offset"] or 0)


def _steps(camera: NumberedCamera, unit: str, value: float, per_unit: int) -> bytes:
    largest = (2**23 - 1) / per_unit
    if abs(value) > largest:
        lacks = f"freed holds up to {largest:.0f} {unit}; camera {camera.id} has {value:.1f}."
        raise cannot_hold(camera.id, lacks, value)
    return round(value * per_unit).to_bytes(3, "big", signed=True)
