"""Check of a calibration that anybody made: its options, a grade for each camera, and the cause."""

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.base import OPEN_WORD, Id, Schema, with_example
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.names import FormatName
from service.schemas.options import Handling, Seed

Grade = Literal["good", "drifted", "wrong", "cannot-tell"]
# From the worst: the grade of a file is that of its worst camera.
GRADES: tuple[Grade, ...] = ("wrong", "drifted", "cannot-tell", "good")


class CheckOptions(Handling):
    """Options of a check: the field that the cameras look at, which the files of most tools do not have."""

    model_config = with_example(field={"template": "tennis"})

    field: FieldOfPlay
    seed: Seed | None = Field(None, description="Absent: one is chosen.")


class CheckedCamera(Schema):
    """A camera as its file has it, in ESC's convention; the world is the file's."""

    id: Id
    image_size: list[int] | None = Field(description="Width and height in pixels; null if the file has none.")
    intrinsics: Intrinsics
    pose: Pose | None = Field(description="Null for a lens alone.")


class CheckedFile(CheckOptions):
    """Options of a check with what was read of the calibration."""

    format: FormatName
    cameras: list[CheckedCamera]


class CheckCause(Schema):
    """Cause of a grade."""

    cause: str = Field(description="In a word, such as `turned` or `centimetres`.")
    detail: str = Field(description="In words with numbers.")


class CameraCheck(Schema):
    """Grade of the calibration of one camera.

    What it is off by is counted from where the calibration puts the markings, in the convention that fits.
    """

    id: Id = Field(description="Id of the camera.")
    grade: Annotated[Grade, OPEN_WORD] = Field(description="Grade of the camera.")
    causes: list[CheckCause] = Field(description="Causes of the grade; beside a good one, faults where no marking is.")
    off_px: float | None = Field(description="Mean shift of the markings in view, pixels.")
    sigma_px: float | None = Field(description="One standard deviation of it, pixels.")
    off_m: float | None = Field(description="Shift of the farthest marking in view, m on the ground.")
    sigma_m: float | None = Field(description="One standard deviation of it, m.")
    detail: str | None = Field(description="Why there is no grade, and what to do.")
    image_size: list[int] = Field(description="Width and height of the frame, pixels.")
    pose: Pose | None = Field(description="As the frame shows it, in ESC's convention; null where it does not tell.")
    intrinsics: Intrinsics | None = Field(description="As the frame shows them; null where it does not tell.")


class CheckResult(Schema):
    """Check of a calibration."""

    kind: Literal["check"] = Field("check", description="Kind of the job, which says what the result has.")
    grade: Annotated[Grade, OPEN_WORD] = Field(description="The worst of the grades of its cameras.")
    format: FormatName = Field(description="Format that the calibration was read as.")
    field: FieldOfPlay
    cameras: list[CameraCheck] = Field(description="Grade of each camera that has a frame.")
    warnings: list[str] = Field([], description="Doubts about the frames.")
    timings_s: dict[str, float] = Field(description="Seconds by stage.")
    software: str = Field(description="Version of ESC.")

    @property
    def failing(self) -> dict[str, str]:
        """Why each camera that is not good is not, by its id."""
        return {
            one.id: "; ".join(cause.detail for cause in one.causes) or one.detail or one.grade
            for one in self.cameras
            if one.grade != "good"
        }
