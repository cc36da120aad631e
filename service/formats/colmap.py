"""COLMAP's text model: cameras.txt, images.txt and points3D.txt in a zip.

Pixel centres are at 0.5 there and at integers here. Models: OPENCV where it is exact, else FULL_OPENCV.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from service.formats.archive import archive
from service.formats.lens import RADIAL, TANGENTIAL, NumberedCamera

# Parameters after fx, fy, cx, cy, in COLMAP's order (src/colmap/sensor/models.h).
MODELS = {
    "OPENCV": ("k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
}


def write(shots: Sequence[NumberedCamera]) -> bytes:
    """Return a zip of the three files. Images are named as their cameras, with `.jpg`: the frames to put beside them.

    Ids follow the names, as those of `feature_extractor` do: `point_triangulator` takes no model whose ids differ from
    those of its database.
    """
    numbered = list(enumerate(sorted(shots, key=_name), start=1))
    cameras = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]", *(_camera(number, shot) for number, shot in numbered)]
    images = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; then a line of POINTS2D[]"]
    for number, shot in numbered:
        images += [_image(number, shot), ""]
    points = ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]"]
    files = {"cameras.txt": cameras, "images.txt": images, "points3D.txt": points}
    return archive({name: "\n".join([*lines, ""]).encode() for name, lines in files.items()})


def _name(shot: NumberedCamera) -> str:
    """Return the name of the file of a camera's frame."""
    return f"{shot.id}.jpg"


def _camera(number: int, shot: NumberedCamera) -> str:
    shot.require_support("colmap", {*RADIAL, *TANGENTIAL})
    coefficients = shot.coefficients
    enough = not any(coefficients[name] for name in RADIAL if name not in MODELS["OPENCV"])
    model = "OPENCV" if enough else "FULL_OPENCV"
    centre = [value + 0.5 for value in shot.principal]
    parameters = [*shot.focal, *centre, *(coefficients[name] for name in MODELS[model])]
    return _line(number, model, *shot.size, *map(float, parameters))


def _image(number: int, shot: NumberedCamera) -> str:
    pose = shot.camera.pose
    return _line(number, *quaternion(pose.rotation), *pose.translation, number, _name(shot))


def quaternion(rotation: Sequence[float]) -> list[float]:
    """Return the unit quaternion (w, x, y, z) of a Rodrigues vector (rad)."""
    angle = math.hypot(*rotation)
    # sin(a/2)/a -> 1/2.
    scale = math.sin(angle / 2) / angle if angle > 1e-12 else 0.5
    return [math.cos(angle / 2), *(scale * component for component in rotation)]


def _line(*words: str | float) -> str:
    return " ".join(word if isinstance(word, str) else repr(word) for word in words)
