"""Kalibr's camchain YAML: lenses of cameras `cam0` ..., and the way from each camera to the next.

`T_cn_cnm1` (4, 4) takes the camera before to this one, both OpenCV's (x right, y down, z ahead), in metres. The place
of the first camera in the world is in no camchain: it is read as the world, unless all cameras have `T_cam_imu`, which
takes the IMU to the camera. Lenses: `pinhole` with `radtan` (k1, k2, p1, p2) or `equidistant` (`cv2.fisheye`).
"""

from collections.abc import Sequence

from service.formats.lens import NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, camera_matrix, lens_of
from service.formats.rotations import (
    IDENTITY,
    Matrix,
    pose_from_matrix,
    pose_from_translation,
    product,
    rotation_of,
    split_matrix,
    transform_vector,
    transposed,
    vector_of,
)
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.names import LensModel
from service.schemas.problems import Problem

MODELS: dict[str, LensModel] = {"radtan": "opencv", "equidistant": "fisheye", "equi": "fisheye", "none": "opencv"}


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return a chain of the cameras in their order. Cameras without poses get no transform."""
    lines: list[str] = []
    for number, camera in enumerate(cameras):
        before = cameras[number - 1] if number and camera.has_pose and cameras[number - 1].has_pose else None
        lines += [f"cam{number}:", *(f"  {line}" for line in _camera(camera, before))]
    return "\n".join([*lines, ""]).encode()


def _camera(camera: NumberedCamera, before: NumberedCamera | None) -> list[str]:
    if not camera.is_fisheye:
        camera.require_support("kalibr", ("k1", "k2", "p1", "p2"))
    elif camera.intrinsics.matrix[0][1]:
        raise Problem("format-cannot-hold", f"kalibr has no place for skew of the lens of camera {camera.id}.")
    k = camera.coefficients
    coefficients = camera.distortion if camera.is_fisheye else [k[name] for name in ("k1", "k2", "p1", "p2")]
    lines = [] if before is None else ["T_cn_cnm1:", *(f"- {_row(row)}" for row in _transform(before, camera))]
    return [
        *lines,
        "cam_overlaps: []",
        "camera_model: pinhole",
        f"distortion_coeffs: {_row(coefficients)}",
        f"distortion_model: {'equidistant' if camera.is_fisheye else 'radtan'}",
        f"intrinsics: {_row([*camera.focal, *camera.principal])}",
        f"resolution: [{camera.size[0]}, {camera.size[1]}]",
        f"rostopic: /{camera.id}/image_raw",
    ]


def _row(numbers: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(number)) for number in numbers)}]"


def _transform(before: NumberedCamera, camera: NumberedCamera) -> Matrix:
    turn = product(camera.rotation, transposed(before.rotation))
    turned = transform_vector(turn, before.pose.translation)
    moved = [part - by for part, by in zip(camera.pose.translation, turned, strict=True)]
    return [*([*row, part] for row, part in zip(turn, moved, strict=True)), [0.0, 0.0, 0.0, 1.0]]


def recognises(file: ParsedFile) -> bool:
    """True for YAML with a camera that has a model and intrinsics."""
    if file.kind != "yaml" or not isinstance(file.content, dict):
        return False
    return any("camera_model" in camera and "intrinsics" in camera for _, camera in file.top.members())


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras of a chain."""
    cameras = [(name, camera) for name, camera in file.top.members() if "camera_model" in camera]
    by_imu = all("T_cam_imu" in camera for _, camera in cameras)
    poses = [pose_from_matrix(camera["T_cam_imu"]) for _, camera in cameras] if by_imu else _chained(cameras)
    return [
        CameraRecord(_name(name, camera), *_lens(camera), pose)
        for (name, camera), pose in zip(cameras, poses, strict=True)
    ]


def _name(key: str, camera: Node) -> str:
    """Return the name of a camera in its topic, as in `/left/image_raw`, or else its key."""
    topic = camera.get("rostopic")
    parts = [] if topic is None else [part for part in topic.text().split("/") if part]
    return parts[-2] if len(parts) > 1 else key


def _lens(camera: Node) -> tuple[Intrinsics, tuple[int, int]]:
    if camera["camera_model"].value != "pinhole":
        camera["camera_model"].refuse("pinhole (omni, eucm and ds have no counterpart in OpenCV)")
    model = camera["distortion_model"]
    if model.value not in MODELS:
        model.refuse(f"one of {', '.join(MODELS)}")
    coefficients = [] if model.value == "none" else camera["distortion_coeffs"].numbers(4)
    lens = lens_of(camera, camera_matrix(*camera["intrinsics"].numbers(4)), coefficients, MODELS[model.value])
    return lens, camera["resolution"].size()


def _chained(cameras: Sequence[tuple[str, Node]]) -> list[Pose | None]:
    """Return the poses by the way from camera to camera, the first one in the origin; None without such a way."""
    turn, moved = IDENTITY, [0.0, 0.0, 0.0]
    if not any("T_cn_cnm1" in camera for _, camera in cameras):
        return [None for _ in cameras]
    poses: list[Pose | None] = []
    for number, (_, camera) in enumerate(cameras):
        if number:
            node = camera["T_cn_cnm1"]
            rotation, translation = split_matrix(node)
            rotation_of(node, rotation)
            moved = [part + by for part, by in zip(translation, transform_vector(rotation, moved), strict=True)]
            turn = product(rotation, turn)
        poses.append(pose_from_translation(vector_of(turn), moved))
    return poses
