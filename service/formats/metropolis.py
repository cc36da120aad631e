"""NVIDIA Metropolis' calibration.json: a sensor for each camera, as VSS and the AI City Challenge read it.

Fields and their types are those of the calibration schema of NVIDIA's Video Search and Summarization (VSS) 3.3,
https://docs.nvidia.com/vss/system-components/calibration/calibration-schema; what the matrices mean is what
`loaders/calibration.py` of its `spatialai-data-utils` makes of them. Their world is ours, in metres (`cartesian`):
origin in the middle of the field, z up. `extrinsicMatrix` (3, 4) takes the world to OpenCV's camera, and
`cameraMatrix` (3, 4) is intrinsic times extrinsic, in whose product the third number is the depth in metres.

There is no place for distortion: the matrices are for the picture without it, of the same size and with the same
intrinsic matrix, as `cv2.undistort(frame, matrix, distortion)` makes it.

`homography`, which need not be there, is left out: in the data of the AI City Challenge it takes the ground to pixels,
in the calibrations that come with VSS pixels to the ground. Readers that miss it compute it from `imageCoordinates`
and `globalCoordinates`.
"""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

from service.formats.lens import COEFFICIENTS, NumberedCamera, cannot_hold
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, lens_of
from service.formats.rotations import pose_from_matrix, product, transform_vector, transposed

# Pixels and the ground behind them are told at so many columns and rows of the picture, where the ground is no farther
# off: next to the horizon a pixel is many metres.
COLUMNS, ROWS = 5, 9
FARTHEST_M = 150.0
# A homography has four points.
LEAST_POINTS = 4
# The schema wants a place on the globe, which a field does not have; `cartesian` does not read it.
NOWHERE = {"lat": 0.0, "lng": 0.0}


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return all cameras in one object. Raises `Problem` for a fisheye, a skew and a camera that sees no ground."""
    sensors = [_sensor(camera) for camera in cameras]
    document = {"version": "1.0", "osmURL": "", "calibrationType": "cartesian", "sensors": sensors}
    return (json.dumps(document, indent=2) + "\n").encode()


def _sensor(camera: NumberedCamera) -> dict[str, Any]:
    # Coefficients are not held, but taken off the picture before.
    camera.require_support("metropolis", COEFFICIENTS)
    pose = camera.pose
    intrinsic = [[float(value) for value in row] for row in camera.intrinsics.matrix]
    extrinsic = [[*row, moved] for row, moved in zip(camera.rotation, pose.translation, strict=True)]
    pairs = list(_ground_points(camera))
    if len(pairs) < LEAST_POINTS:
        lacks = (
            f"metropolis wants {LEAST_POINTS} pixels with the ground behind them, within {FARTHEST_M:g} m, and camera "
            f"{camera.id} has {len(pairs)}."
        )
        raise cannot_hold(camera.id, lacks, ["no ground in view"])
    return {
        "type": "camera",
        "id": camera.id,
        "origin": NOWHERE,
        "geoLocation": NOWHERE,
        "coordinates": dict(zip("xyz", map(float, pose.position), strict=True)),
        # A pixel of a floor plan is (world + translation) * scale: for a plan with a pixel for each metre, until there
        # is another one.
        "scaleFactor": 1.0,
        "translationToGlobalCoordinates": {"x": 0.0, "y": 0.0},
        "attributes": [
            {"name": name, "value": str(pixels)}
            for name, pixels in zip(("frameWidth", "frameHeight"), camera.size, strict=True)
        ],
        "place": [{"name": "building", "value": "field"}],
        "imageCoordinates": [{"x": column, "y": row} for (column, row), _ in pairs],
        "globalCoordinates": [{"x": x, "y": y, "z": 0.0} for _, (x, y) in pairs],
        "intrinsicMatrix": intrinsic,
        "extrinsicMatrix": extrinsic,
        "cameraMatrix": product(intrinsic, extrinsic),
    }


def _ground_points(camera: NumberedCamera) -> Iterator[tuple[tuple[int, int], tuple[float, float]]]:
    """Return pixels (column, row) of the undistorted picture, and x, y of the ground (z = 0) that they show."""
    width, height = camera.size
    for row in (round(height * (number + 0.5) / ROWS) for number in range(ROWS)):
        for column in (round(width * (number + 0.5) / COLUMNS) for number in range(COLUMNS)):
            ground = _ground_behind(camera, column, row)
            if ground is not None:
                yield (column, row), ground


def _ground_behind(camera: NumberedCamera, column: int, row: int) -> tuple[float, float] | None:
    """Return x, y of the ground (z = 0) that a pixel of the undistorted picture shows; None: sky, or far off."""
    (fx, fy), (cx, cy) = camera.focal, camera.principal
    right, ahead, up = transform_vector(transposed(camera.rotation), [(column - cx) / fx, (row - cy) / fy, 1.0])
    x, y, height = camera.pose.position
    if up == 0 or height / -up <= 0:
        return None
    distance = height / -up
    if distance * math.hypot(right, ahead) > FARTHEST_M:
        return None
    return x + distance * right, y + distance * ahead


def recognises(file: ParsedFile) -> bool:
    """True for a document with sensors."""
    return file.kind == "json" and isinstance(file.top.value, dict) and isinstance(file.top.value.get("sensors"), list)


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras among the sensors, without distortion."""
    kind = file.top.get("calibrationType")
    if kind is not None and kind.value != "cartesian":
        kind.refuse("cartesian, in metres: places on the globe are in no field")
    sensors = file.top["sensors"].elements()
    return [_camera(sensor) for sensor in sensors if sensor.get("type") is None or sensor["type"].value == "camera"]


def _camera(sensor: Node) -> CameraRecord:
    matrix = sensor["intrinsicMatrix"]
    lens = lens_of(matrix, matrix.matrix(3, 3), [])
    attributes = sensor.get("attributes")
    named = {} if attributes is None else {one["name"].text(): one["value"] for one in attributes.elements()}
    size = None
    if "frameWidth" in named and "frameHeight" in named:
        size = _pixels(named["frameWidth"]), _pixels(named["frameHeight"])
    return CameraRecord(str(sensor["id"].value), lens, size, pose_from_matrix(sensor["extrinsicMatrix"]))


def _pixels(node: Node) -> int:
    """Return a number of pixels, which attributes have as text."""
    text = str(node.value)
    if not text.isascii() or not text.isdigit():
        node.refuse("a number of pixels")
    return int(text)
