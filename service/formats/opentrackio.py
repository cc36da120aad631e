"""OpenTrackIO 1.0.1 (SMPTE RIS OSVP): a sample of JSON per camera, for virtual production.

World: metres, z up, right-handed, as here. A camera without pan, tilt and roll looks along y; rotation is intrinsic
z-x-y, degrees: pan is positive to the left seen from above, tilt upwards, roll clockwise from behind. The pose is
that of the pinhole, so the entrance pupil has no offset. Lengths on the sensor are those of a sensor 36 mm wide: a
calibration knows no millimetres, and only ratios to the sensor's size reach a pixel. The middle of the picture is
pixel (W/2, H/2), as in SMPTE's "Conversion of OpenCV to OpenTrackIO" (corrected 2025-09-02).
"""

import json
import math
import uuid
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal

from service.formats.lens import RADIAL, TANGENTIAL, NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of, stem_of
from service.formats.rotations import IDENTITY, product, rotation_about, transform_vector, transposed, vector_of
from service.schemas.geometry import Pose
from service.schemas.problems import Problem

SENSOR_WIDTH_MM = 36.0
# Camera axes from OpenCV's (x right, y down, z ahead) to x right, y ahead, z up.
AHEAD_IS_Y = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
# A second of timecode has no more.
MOST_FRAMES = 120
SEQUENCE_NUMBERS = 2**32
SOURCES = uuid.UUID("3d6b2a0e-7f3c-5c8f-9d2b-52b8f4a7c1e6")


# Sources of the time of a clock that no video signal triggers.
ClockSource = Literal["ntp", "ptp"]
# A venue knows its cameras by their ids alone, and Unreal 5.7 shows none of which one of the three is missing.
UNKNOWN = "unknown"


@dataclass(frozen=True)
class SampleTime:
    """Time of a sample of a stream: `unix_ns` by the machine's or the camera's clock, and its `number` from 0.

    `rate`: samples a second; `status`: that of the tracking; `is_locked`: True if the clock follows `clock_source`;
    None: unknown.
    """

    unix_ns: int
    number: int
    rate: Fraction
    status: str
    is_locked: bool | None = None
    clock_source: ClockSource = "ntp"


@dataclass(frozen=True)
class Frame:
    """A frame of a clip: its `number` from 0, at `rate` frames a second; `status`: that of the tracking."""

    number: int
    rate: Fraction
    status: str


@dataclass(frozen=True)
class SteadyAngles:
    """Pan, tilt and roll of cameras from sample to sample, in degrees, without jumps at 180 degrees.

    Renderers fill in between samples: between 179.99 and -179.99 they would swing once round.
    """

    _last: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    def of(self, camera: NumberedCamera) -> tuple[float, float, float]:
        """Return the angles of the next sample of a camera, each as near to those of the one before as turns allow."""
        angles = _pan_tilt_roll_deg(camera)
        last = self._last.get(camera.id, angles)
        pan, tilt, roll = (
            angle + 360 * round((before - angle) / 360) for angle, before in zip(angles, last, strict=True)
        )
        self._last[camera.id] = pan, tilt, roll
        return pan, tilt, roll


def write(camera: NumberedCamera) -> bytes:
    """Return a sample of a camera that stands still, without timing."""
    return (json.dumps(_with_sample_id(_sample(camera, _pan_tilt_roll_deg(camera))), indent=2) + "\n").encode()


def write_frame(camera: NumberedCamera, frame: Frame, angles: SteadyAngles) -> bytes:
    """Return a sample of a clip, a line of JSON. Its timecode is 00:00:00:00 at the first frame, and has no drops.

    The samples travel beside the video, whose frames they are of: nobody knows by a clock when those were taken.
    """
    sample = _timed(camera, frame, angles, {"sequenceNumber": frame.number, "timecode": _timecode(frame)})
    return (json.dumps(sample, separators=(",", ":")) + "\n").encode()


def moment_sample(camera: NumberedCamera, moment: SampleTime, angles: SteadyAngles) -> dict[str, Any]:
    """Return a sample of a stream. Its timestamp is UTC in seconds since 1970 by the clock of the moment."""
    seconds, nanoseconds = divmod(moment.unix_ns, 1_000_000_000)
    timing = {
        "sampleTimestamp": {"seconds": seconds, "nanoseconds": nanoseconds},
        "sequenceNumber": moment.number % SEQUENCE_NUMBERS,
        **_synchronization(moment),
    }
    return _timed(camera, moment, angles, timing)


def _timed(
    camera: NumberedCamera, moment: SampleTime | Frame, angles: SteadyAngles, timing: dict[str, Any]
) -> dict[str, Any]:
    when = {"mode": "external", "sampleRate": _rational(moment.rate), **timing}
    return _with_sample_id(_sample(camera, angles.of(camera)) | {"tracker": {"status": moment.status}, "timing": when})


def _synchronization(moment: SampleTime) -> dict[str, Any]:
    """Return how the clock of a moment is synchronised, empty if nobody knows.

    A source to which no clock is locked may be there or not.
    """
    if moment.is_locked is None:
        return {}
    locked = {"locked": True, "present": True} if moment.is_locked else {"locked": False}
    return {"synchronization": {"source": moment.clock_source, **locked}}


def _sample(camera: NumberedCamera, angles: tuple[float, float, float]) -> dict[str, Any]:
    return {
        "protocol": {"name": "OpenTrackIO", "version": [1, 0, 1]},
        "static": {"camera": _sensor(camera)},
        "lens": _lens(camera),
        "transforms": [_transform(camera, angles)],
        "sourceId": uuid.uuid5(SOURCES, camera.id).urn,
        "sourceNumber": camera.number,
    }


def _with_sample_id(sample: dict[str, Any]) -> dict[str, Any]:
    """Add an id, which is the same for the same sample."""
    return sample | {"sampleId": uuid.uuid5(SOURCES, json.dumps(sample, sort_keys=True)).urn}


def _timecode(frame: Frame) -> dict[str, Any]:
    """Return the timecode of a frame, without drops: counted in whole frames a second, 29.97 by 30."""
    a_second = math.ceil(frame.rate)
    if a_second > MOST_FRAMES:
        raise Problem(
            "format-cannot-hold",
            f"opentrackio holds timecode of up to {MOST_FRAMES} frames a second; the clip has {float(frame.rate):g}.",
            got=float(frame.rate),
        )
    seconds, frames = divmod(frame.number, a_second)
    return {
        "hours": seconds // 3600 % 24,
        "minutes": seconds // 60 % 60,
        "seconds": seconds % 60,
        "frames": frames,
        "frameRate": _rational(frame.rate),
        "dropFrame": False,
    }


def _rational(rate: Fraction) -> dict[str, int]:
    return {"num": rate.numerator, "denom": rate.denominator}


def _sensor(camera: NumberedCamera) -> dict[str, Any]:
    (width, height), (fx, fy) = camera.size, camera.focal
    return {
        "make": UNKNOWN,
        "model": UNKNOWN,
        "serialNumber": camera.id,
        "label": camera.id,
        "activeSensorResolution": {"width": width, "height": height},
        # There is one focal length: pixels that are not square are told by the height.
        "activeSensorPhysicalDimensions": {
            "width": SENSOR_WIDTH_MM,
            "height": SENSOR_WIDTH_MM * fx * height / (width * fy),
        },
    }


def _lens(camera: NumberedCamera) -> dict[str, Any]:
    camera.require_support("opentrackio", {*RADIAL, *TANGENTIAL})
    (width, height), (fx, fy), (cx, cy) = camera.size, camera.focal, camera.principal
    focal = fx * SENSOR_WIDTH_MM / width
    k = camera.coefficients
    return {
        "pinholeFocalLength": focal,
        "entrancePupilOffset": 0.0,
        # mm per pixel is focal / fx across and focal / fy down.
        "projectionOffset": {"x": (cx - width / 2) * focal / fx, "y": (cy - height / 2) * focal / fy},
        "distortion": [
            {
                # Without a name it would be the other direction.
                "model": "Brown-Conrady U-D",
                # Numerator and denominator in turn, radii in mm. Always all six: Unreal ignores shorter lists.
                "radial": [
                    value / focal**power
                    for value, power in (
                        (k["k1"], 2),
                        (k["k4"], 2),
                        (k["k2"], 4),
                        (k["k5"], 4),
                        (k["k3"], 6),
                        (k["k6"], 6),
                    )
                ],
                # By the focal length, not by its square as in SMPTE's conversion notes, which are pixels off.
                "tangential": [k["p1"] / focal, k["p2"] / focal],
            }
        ],
    }


def _transform(camera: NumberedCamera, angles: tuple[float, float, float]) -> dict[str, Any]:
    pan, tilt, roll = angles
    x, y, z = camera.pose.position
    return {
        "id": "camera",
        "translation": {"x": x, "y": y, "z": z},
        "rotation": {"pan": pan, "tilt": tilt, "roll": roll},
    }


def _pan_tilt_roll_deg(camera: NumberedCamera) -> tuple[float, float, float]:
    b = product(transposed(camera.rotation), transposed(AHEAD_IS_Y))
    pan, tilt, roll = pan_tilt_roll(b)
    return math.degrees(pan), math.degrees(tilt), math.degrees(roll)


def pan_tilt_roll(b: list[list[float]]) -> tuple[float, float, float]:
    """Return the intrinsic z-x-y angles, in radians, of a matrix (3, 3), camera (x right, y ahead, z up) to world."""
    level = math.hypot(b[0][1], b[1][1])
    # An arc sine loses half of the digits near the vertical.
    tilt = math.atan2(b[2][1], level)
    if level < 1e-9:
        # Straight up or down: pan and roll turn about the same axis; the pan takes it all.
        return math.atan2(b[1][0], b[0][0]), tilt, 0.0
    return math.atan2(-b[0][1], b[1][1]), tilt, math.atan2(-b[2][0], b[2][2])


def recognises(file: ParsedFile) -> bool:
    """True for a sample with a lens."""
    return file.kind == "json" and "transforms" in file.top and "lens" in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the camera of a sample, by its label or else its file's name."""
    camera, lens = file.top["static"]["camera"], file.top["lens"]
    resolution, sensor = camera["activeSensorResolution"], camera["activeSensorPhysicalDimensions"]
    size = resolution["width"].integer(1), resolution["height"].integer(1)
    focal = lens["pinholeFocalLength"].number()
    per_mm = [side / sensor[name].number() for side, name in zip(size, ("width", "height"), strict=True)]
    offset = lens.get("projectionOffset")
    moved = [0.0, 0.0] if offset is None else [offset[axis].number() for axis in "xy"]
    centre = [side / 2 + scale * by for side, scale, by in zip(size, per_mm, moved, strict=True)]
    matrix = camera_matrix(per_mm[0] * focal, per_mm[1] * focal, *centre)
    coefficients = [] if "distortion" not in lens else _coefficients(lens["distortion"].elements()[0], focal)
    label = camera.get("label")
    name = label.text() if label is not None else stem_of(file.name)
    return [CameraRecord(name, lens_of(lens, matrix, coefficients), size, _pose(file.top))]


def _coefficients(model: Node, focal: float) -> list[float]:
    named = model.get("model")
    if named is None or named.value not in ("Brown-Conrady U-D", "Brown-Conrady-Undistorted-to-Distorted"):
        model.refuse("the model Brown-Conrady U-D; without a name, or D-U, it is the other direction")
    radial = [
        number * focal ** (2 * (n // 2 + 1)) for n, number in enumerate([*model["radial"].numbers(), *[0.0] * 6][:6])
    ]
    k1, k4, k2, k5, k3, k6 = radial
    tangential = model.get("tangential")
    p1, p2 = [0.0, 0.0] if tangential is None else [number * focal for number in tangential.numbers(2)]
    coefficients = [k1, k2, p1, p2, k3, k4, k5, k6]
    while coefficients and coefficients[-1] == 0:
        coefficients.pop()
    return coefficients


def _pose(top: Node) -> Pose:
    """Return the pose after all transforms, each in the frame of the one before, and the offset of the pupil."""
    turned, place = IDENTITY, [0.0, 0.0, 0.0]
    for transform in top["transforms"].elements():
        moved = transform_vector(turned, [transform["translation"][axis].number() for axis in "xyz"])
        place = [at + by for at, by in zip(place, moved, strict=True)]
        for axis, name in (("z", "pan"), ("x", "tilt"), ("y", "roll")):
            turned = product(turned, rotation_about(axis, math.radians(transform["rotation"][name].number())))
    pupil = top["lens"].get("entrancePupilOffset")
    ahead = 0.0 if pupil is None else pupil.number()
    place = [at + ahead * row[1] for at, row in zip(place, turned, strict=True)]
    return Pose.from_position(vector_of(transposed(product(turned, AHEAD_IS_Y))), place)
