"""ESC's own JSON: ids, sizes, lenses and poses in OpenCV's convention, exactly as a venue has them.

Also read: a venue's file, of which the cameras count. A single lens without a pose is a file as `esc intrinsics` writes
and `esc pose` takes it.
"""

import json
from collections.abc import Sequence
from typing import Any

from service.formats.lens import NumberedCamera
from service.formats.nodes import Node
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord, read_lens, stem_of
from service.formats.rotations import pose_from_translation, read_vector
from service.schemas.geometry import Pose


def write(cameras: Sequence[NumberedCamera]) -> bytes:
    """Return all cameras in one object."""
    documents = [camera.camera.model_dump(mode="json") for camera in cameras]
    whole: dict[str, Any] = {"cameras": documents}
    if len(cameras) == 1 and not cameras[0].has_pose:
        whole = {name: documents[0][name] for name in ("image_size", "intrinsics")}
    return (json.dumps(whole, indent=2) + "\n").encode()


def recognises(file: ParsedFile) -> bool:
    """True for a document with cameras, or with one lens."""
    if file.kind != "json":
        return False
    cameras = file.top.get("cameras")
    if cameras is not None and isinstance(cameras.value, list):
        return any(isinstance(one, dict) and "intrinsics" in one for one in cameras.value)
    return "intrinsics" in file.top and "image_size" in file.top


def read(file: ParsedFile) -> list[CameraRecord]:
    """Return the cameras of a document."""
    cameras = file.top.get("cameras")
    if cameras is None:
        return [_camera(file.top, stem_of(file.name))]
    return [_camera(camera, camera["id"].text()) for camera in cameras.elements()]


def _camera(node: Node, name: str) -> CameraRecord:
    size, lens = node["image_size"].size(), node["intrinsics"]
    return CameraRecord(name, read_lens(lens, lens.value), size, _pose(node["pose"]) if "pose" in node else None)


def _pose(node: Node) -> Pose:
    rotation = read_vector(node["rotation"])
    if "translation" not in node:
        return Pose.from_position(rotation, node["position"].numbers(3))
    pose = pose_from_translation(rotation, node["translation"].numbers(3))
    return pose if "position" not in node else pose.model_copy(update={"position": node["position"].numbers(3)})
