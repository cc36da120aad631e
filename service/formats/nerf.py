"""transforms.json of NeRF tools (instant-ngp, nerfstudio, gsplat): a frame for each camera.

`transform_matrix` takes OpenGL's camera (x right, y up, z backwards) to the world, z up; its unit is open. Pixel
centres are at 0.5. Numbers of the lens stand at the top, or in a frame where they differ. Lenses: k1, k2, k3, p1, p2
of OpenCV, or k1 to k4 of `cv2.fisheye` with `camera_model` OPENCV_FISHEYE (nerfstudio) or `is_fisheye` (instant-ngp).
"""

import json
import math
from collections.abc import Sequence
from typing import Any

from service.formats.lens import NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of, stem_of
from service.formats.rotations import Matrix, rotation_of, split_matrix, transposed, vector_of
from service.schemas.geometry import Intrinsics, Pose

SUPPORTED = ("k1", "k2", "p1", "p2", "k3")
FISHEYE = ("k1", "k2", "k3", "k4")
OF_A_FRAME = ("file_path", "transform_matrix")
# Without distortion beyond these parameters.
BROWN_MODELS = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return all cameras; pictures are named as their cameras, with `.jpg`."""
    frames = [_frame(camera) for camera in cameras]
    shared = {
        key: value
        for key, value in frames[0].items()
        if key not in OF_A_FRAME and all(frame.get(key) == value for frame in frames)
    }
    frames = [{key: value for key, value in frame.items() if key not in shared} for frame in frames]
    return (json.dumps({**shared, "frames": frames}, indent=2) + "\n").encode()


def _frame(camera: NumberedCamera) -> dict[str, Any]:
    if camera.is_fisheye:
        k = dict(zip(FISHEYE, camera.distortion, strict=True))
    else:
        camera.require_support("nerf", SUPPORTED)
        k = {name: camera.coefficients[name] for name in SUPPORTED}
    (fx, fy), (cx, cy), (width, height) = camera.focal, camera.principal, camera.size
    rows = [[*row, part] for row, part in zip(_turned(transposed(camera.rotation)), camera.pose.position, strict=True)]
    return {
        "camera_model": "OPENCV_FISHEYE" if camera.is_fisheye else "OPENCV",
        **({"is_fisheye": True} if camera.is_fisheye else {}),
        **{"w": width, "h": height, "fl_x": fx, "fl_y": fy, "cx": cx + 0.5, "cy": cy + 0.5},
        **k,
        "file_path": f"{camera.id}.jpg",
        "transform_matrix": [*rows, [0.0, 0.0, 0.0, 1.0]],
    }


def _turned(to_world: Matrix) -> Matrix:
    """Return the rotation, camera to world, for OpenGL's camera of one for OpenCV's, and the other way round."""
    return [[right, -down, -ahead] for right, down, ahead in to_world]


def recognises(file: ParsedFile) -> bool:
    """True for a document with frames that have a transform."""
    frames = file.top.get("frames") if file.kind == "json" else None
    return (
        frames is not None
        and isinstance(frames.value, list)
        and any(isinstance(one, dict) and "transform_matrix" in one for one in frames.value)
    )


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return a camera for each frame, named as its picture."""
    return [_camera(file.top, frame) for frame in file.top["frames"].elements()]


def _camera(top: Node, frame: Node) -> CameraRecord:
    lens, size = _lens(top, frame)
    node = frame["transform_matrix"]
    to_world, position = split_matrix(node)
    rotation_of(node, to_world)
    pose = Pose.from_position(vector_of(transposed(_turned(to_world))), position)
    path = frame.get("file_path")
    return CameraRecord("camera" if path is None else stem_of(path.text()), lens, size, pose)


def _lens(top: Node, frame: Node) -> tuple[Intrinsics, tuple[int, int] | None]:
    def member(name: str) -> Node | None:
        return frame.get(name) or top.get(name)

    def number(name: str, otherwise: float = 0.0) -> float:
        node = member(name)
        return otherwise if node is None else node.number()

    width, height = member("w"), member("h")
    size = None if width is None or height is None else (width.integer(1), height.integer(1))
    angle = number("camera_angle_x")
    if not 0 <= angle < math.pi:
        frame.refuse("a camera_angle_x of less than half a turn", f"{angle:g}")
    if member("fl_x") is None and not (angle and size):
        frame.refuse("fl_x, or camera_angle_x with w and h", "neither")
    fx = number("fl_x") if size is None or not angle else number("fl_x", size[0] / 2 / math.tan(angle / 2))
    if size is None and (member("cx") is None or member("cy") is None):
        frame.refuse("cx and cy, or w and h", "neither")
    cx, cy = (number(name, side / 2) - 0.5 for name, side in zip(("cx", "cy"), size or (0, 0), strict=True))
    matrix = camera_matrix(fx, number("fl_y", fx), cx, cy)
    model, flagged = member("camera_model"), member("is_fisheye")
    if (flagged is not None and flagged.flag()) or (model is not None and model.value == "OPENCV_FISHEYE"):
        return lens_of(frame, matrix, [number(name) for name in FISHEYE], "fisheye"), size
    if model is not None and model.value not in BROWN_MODELS:
        model.refuse(f"one of {', '.join(BROWN_MODELS)}, OPENCV_FISHEYE")
    fourth = member("k4")
    if fourth is not None and fourth.number() != 0:
        fourth.refuse("0: OpenCV's lens has no term of the eighth order")
    return lens_of(frame, matrix, [number(name) for name in SUPPORTED]), size
