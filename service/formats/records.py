"""A camera as a file has it, in ESC's convention.

Axes and coefficients are OpenCV's, poses go from the world to the camera, pixel centres are at integers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

from pydantic import ValidationError

from service.formats.lens import NumberedCamera, cannot_hold
from service.formats.nodes import Node
from service.schemas.base import TOLERANTLY
from service.schemas.check import CheckedCamera
from service.schemas.findings import describe_errors
from service.schemas.geometry import DISTORTION_LENGTHS, Intrinsics, Pose, PosedCamera, UnposedCamera
from service.schemas.names import LensModel, id_like


@dataclass(frozen=True)
class CameraRecord:
    """A camera that was read from a file.

    `id`: its name there; `size` (width, height) and `pose` are None where the file has none. The world is the file's.
    """

    id: str
    intrinsics: Intrinsics
    size: tuple[int, int] | None = None
    pose: Pose | None = None

    @property
    def to_check(self) -> CheckedCamera:
        """The camera as a check takes it."""
        size = None if self.size is None else [*self.size]
        return CheckedCamera(id=self.id, image_size=size, intrinsics=self.intrinsics, pose=self.pose)

    def numbered(self, number: int) -> NumberedCamera:
        """Return the camera for the writers, which need its picture size: one without is refused."""
        if self.size is None:
            lacks = f"camera {self.id} has no picture size in its file: give it with --image-size WxH."
            raise cannot_hold(self.id, lacks, ["no picture size"])
        # Not validated: a check wants to write what no venue would take, such as places in centimetres.
        unposed = UnposedCamera.model_construct(id=self.id, image_size=[*self.size], intrinsics=self.intrinsics)
        if self.pose is None:
            return NumberedCamera(unposed, number)
        return NumberedCamera(PosedCamera.model_construct(**dict(unposed), pose=self.pose), number)


def lens_of(
    node: Node, matrix: Sequence[Sequence[float]], coefficients: Sequence[float], model: LensModel = "opencv"
) -> Intrinsics:
    """Return a lens of the numbers at a node; coefficients that are absent at the end are zero."""
    length = next((length for length in DISTORTION_LENGTHS[model] if length >= len(coefficients)), len(coefficients))
    padded = [*coefficients, *[0.0] * (length - len(coefficients))]
    return read_lens(node, {"model": model, "matrix": matrix, "distortion": padded})


def read_lens(node: Node, document: Mapping[str, Any]) -> Intrinsics:
    """Return the lens of a document in ESC's own form; `node`: where it stands."""
    try:
        return Intrinsics.model_validate(document, **TOLERANTLY)
    except ValidationError as error:
        node.refuse("a lens", "; ".join(describe_errors(error.errors(), None, None)))


def camera_matrix(fx: float, fy: float, cx: float, cy: float) -> list[list[float]]:
    """Return the camera matrix of focal lengths and principal point."""
    return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def stem_of(file: str) -> str:
    """Return the name of a file without folders and its last suffix: of a picture, the name of its camera."""
    return PurePath(file.replace("\\", "/")).stem


def with_distinct_ids(cameras: Sequence[CameraRecord]) -> list[CameraRecord]:
    """Return cameras whose names are made ids of ESC, no two of them the same."""
    named: dict[str, CameraRecord] = {}
    for number, camera in enumerate(cameras, start=1):
        wanted = id_like(camera.id) or f"camera-{number}"
        id, again = wanted, 2
        while id in named:
            id, again = f"{wanted[:60]}-{again}", again + 1
        named[id] = replace(camera, id=id)
    return list(named.values())
