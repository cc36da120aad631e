"""A set of cases on disk: what a method sees of each, and beside it the truth, which it does not see.

    SET/cases/NAME/case.json    task, field, cameras as far as they are known, frames by moment
    SET/cases/NAME/*.jpg        the frames
    SET/truth/NAME.json         the cameras that took the frames, moment by moment
    ANSWERS/NAME.json           what a method says

A field, a lens and a pose are written as in ESC's interface; the README describes them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from pydantic import BaseModel

from service.schemas.field import FieldOfPlay
from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.geometry import Intrinsics, Pose, PosedCamera, PoseIn
from service.schemas.results import Sigma
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.jobs.from_schemas import camera_of, pitch_of
from worker.jobs.to_schemas import lens_to_schema, pose_to_schema, ridge_to_schema

Task = Literal["keep", "find", "nights", "rigs"]
TASKS: tuple[Task, ...] = ("keep", "find", "nights", "rigs")
JPEG_QUALITY = 92


class Case(BaseModel):
    """What a method sees: the site, and the file of each camera's frame at each moment, in the order of time.

    Cameras of `find` have no pose, and half of them no lens.
    """

    task: Task
    site: SoughtSite
    moments: list[dict[str, str]]
    lines: list[list[tuple[float, float]]] = []
    """Middle of the paint of each line of the field, as the site has it: corners of a polyline, x and y, metres."""

    @property
    def pitch(self) -> Field:
        """The field as the site has it."""
        return pitch_of(self.site.field)

    @property
    def cameras(self) -> list[Camera]:
        """The cameras at their stored poses; of a case that has them."""
        return [_stored(camera) for camera in self.site.cameras]

    def frames(self, folder: Path, moment: int) -> dict[str, list[Frame]]:
        """Read the frames of a moment from the case's folder, BGR (height, width, 3)."""
        return {
            camera: [np.asarray(cv2.imread(str(folder / file), cv2.IMREAD_COLOR), np.uint8)]
            for camera, file in self.moments[moment].items()
        }


class TrueCamera(BaseModel):
    """The camera that took a frame; `shows_field`: whether that frame shows enough of the field to find it."""

    camera: PosedCamera
    shows_field: bool

    @property
    def posed(self) -> Camera:
        """The camera with the lens and the pose that it really has."""
        return camera_of(self.camera)


class Truth(BaseModel):
    """The field as it is painted, and the cameras at each moment."""

    field: FieldOfPlay
    moments: list[list[TrueCamera]]


class CameraAnswer(BaseModel):
    """What a method says of one camera at one moment; a camera of a `result.json` of ESC can be read as one.

    `accepted`: whether the method takes its own pose for right. Without `intrinsics` the lens of the case counts.
    """

    id: str
    accepted: bool
    pose: PoseIn | None = None
    intrinsics: Intrinsics | None = None
    sigma: Sigma | None = None

    @classmethod
    def of(cls, camera: Camera, *, accepted: bool, sigma: Sigma | None = None) -> CameraAnswer:
        """Return the answer that a camera stands where it does, with its lens."""
        pose = pose_to_schema(camera.pose)
        return cls(
            id=camera.id,
            accepted=accepted,
            pose=PoseIn(rotation=pose.rotation, position=pose.position),
            intrinsics=lens_to_schema(camera.intrinsics),
            sigma=sigma,
        )

    def posed(self, known: SoughtCameraIn, size: Sequence[int]) -> Camera | None:
        """Return the camera that the answer means; None if it does not say enough."""
        lens = self.intrinsics or known.intrinsics
        if self.pose is None or lens is None:
            return None
        pose = Pose.from_input(self.pose)
        return camera_of(PosedCamera(id=self.id, image_size=list(size), intrinsics=lens, pose=pose))


class MomentAnswer(BaseModel):
    """The cameras of one moment; those that are missing count as refused."""

    cameras: list[CameraAnswer]


class Answer(BaseModel):
    """All moments of a case, in the order of time; the answer to one may not depend on later ones."""

    moments: list[MomentAnswer]


class CaseSet:
    """The folder of a set."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def names(self) -> list[str]:
        """Names of its cases."""
        return sorted(path.parent.name for path in self.folder.glob("cases/*/case.json"))

    def case_folder(self, name: str) -> Path:
        """Return the folder of a case and its frames."""
        return self.folder / "cases" / name

    def case(self, name: str) -> Case:
        """Read a case."""
        return Case.model_validate_json((self.case_folder(name) / "case.json").read_text())

    def truth(self, name: str) -> Truth:
        """Read the truth of a case."""
        return Truth.model_validate_json((self.folder / "truth" / f"{name}.json").read_text())

    def write(self, name: str, case: Case, truth: Truth, frames: Mapping[str, Frame]) -> None:
        """Write a case with its frames, by the names that the case has for them, and its truth."""
        folder = self.case_folder(name)
        folder.mkdir(parents=True, exist_ok=True)
        for file, frame in frames.items():
            cv2.imwrite(str(folder / file), frame, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        (folder / "case.json").write_text(case.model_dump_json(indent=1, exclude_none=True))
        (self.folder / "truth").mkdir(exist_ok=True)
        (self.folder / "truth" / f"{name}.json").write_text(truth.model_dump_json(indent=1, exclude_none=True))


def field_to_schema(sport: str, pitch: Field) -> FieldOfPlay:
    """Return a field of a sport's template, in the form of the interface."""
    return FieldOfPlay.model_validate(
        {
            "template": sport,
            "length_m": pitch.length,
            "width_m": pitch.width,
            "line_width_m": pitch.line_width,
            "measures_m": dict(pitch.measures),
            "ridge": ridge_to_schema(pitch),
            "sigma": dict(pitch.sigma),
        }
    )


def camera_to_schema(camera: Camera) -> PosedCamera:
    """Return a camera in the form of the interface."""
    return PosedCamera.model_validate(
        {
            "id": camera.id,
            "image_size": list(camera.intrinsics.size),
            "intrinsics": lens_to_schema(camera.intrinsics),
            "pose": pose_to_schema(camera.pose),
        }
    )


def _stored(camera: SoughtCameraIn) -> Camera:
    """Return a camera whose lens and pose are known."""
    if camera.intrinsics is None or camera.pose is None or camera.image_size is None:
        raise ValueError(f"camera {camera.id} has no stored pose")
    pose = Pose.from_input(camera.pose)
    return camera_of(PosedCamera(id=camera.id, image_size=camera.image_size, intrinsics=camera.intrinsics, pose=pose))
