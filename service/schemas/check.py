"""Result of a check of a calibration that anybody made: a grade for each camera, and the cause."""

from typing import Literal

from pydantic import Field

from service.schemas.base import Id, Schema
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.names import FormatName

Grade = Literal["good", "drifted", "wrong", "cannot-tell"]
# From the worst: the grade of a file is that of its worst camera.
GRADES: tuple[Grade, ...] = ("wrong", "drifted", "cannot-tell", "good")


class CheckCause(Schema):
    """Cause of a grade: in a word, such as `turned` or `centimetres`, and in words with numbers."""

    cause: str
    detail: str


class CameraCheck(Schema):
    """Grade of the calibration of one camera.

    `off_px` ± `sigma_px`: mean shift of the markings in view from where the calibration puts them, in the convention
    that fits; `off_m` ± `sigma_m`: the same of the farthest marking in view, on the ground. `pose` and `intrinsics`: as
    the frame shows them, in ESC's convention; null where it does not tell.
    """

    id: Id
    grade: Grade
    causes: list[CheckCause]
    off_px: float | None
    sigma_px: float | None
    off_m: float | None
    sigma_m: float | None
    detail: str | None = Field(description="Why there is no grade, and what to do.")
    image_size: list[int]
    pose: Pose | None
    intrinsics: Intrinsics | None


class CheckResult(Schema):
    """Check of a calibration: the `format` that it was read as, and the worst of the grades of its cameras."""

    grade: Grade
    format: FormatName
    field: FieldOfPlay
    cameras: list[CameraCheck]
