"""A camera as the formats take it: its numbers by name, and a check that a format can hold its lens."""

from collections.abc import Collection
from dataclasses import dataclass

from service.formats.rotations import Matrix, matrix_of
from service.schemas.encoders import LensEncoders
from service.schemas.geometry import COEFFICIENTS as COEFFICIENTS_BY_MODEL
from service.schemas.geometry import Intrinsics, Pose, PosedCamera, UnposedCamera
from service.schemas.problems import Problem

COEFFICIENTS = COEFFICIENTS_BY_MODEL["opencv"]
RADIAL = ("k1", "k2", "k3", "k4", "k5", "k6")
TANGENTIAL = ("p1", "p2")
THIN_PRISM = ("s1", "s2", "s3", "s4")


def cannot_hold(camera: str, lacks: str, got: list[str] | float) -> Problem:
    """Return the problem of a format that has no place for something of a camera."""
    return Problem("format-cannot-hold", lacks, camera=camera, got=got)


@dataclass(frozen=True)
class NumberedCamera:
    """A camera with its number in the venue, from 1, which formats without names have.

    `camera`: a `PosedCamera`, but of files that have lenses alone; `encoders`: tables of its zoom and focus.
    """

    camera: UnposedCamera
    number: int
    encoders: LensEncoders | None = None

    @property
    def id(self) -> str:
        """Id of the camera."""
        return self.camera.id

    @property
    def intrinsics(self) -> Intrinsics:
        """Lens of the camera."""
        return self.camera.intrinsics

    @property
    def posed(self) -> PosedCamera:
        """The camera; refuses one without a pose, which most formats have no way to say."""
        if not isinstance(self.camera, PosedCamera):
            lacks = f"camera {self.id} has no pose; opencv, ros, kalibr, caliscope and json hold lenses alone."
            raise cannot_hold(self.id, lacks, ["no pose"])
        return self.camera

    @property
    def pose(self) -> Pose:
        """Pose of the camera; refuses one without."""
        return self.posed.pose

    @property
    def has_pose(self) -> bool:
        """True unless only the lens of the camera is known."""
        return isinstance(self.camera, PosedCamera)

    @property
    def is_fisheye(self) -> bool:
        """True for OpenCV's fisheye lens (Kannala-Brandt)."""
        return self.intrinsics.model == "fisheye"

    @property
    def distortion(self) -> list[float]:
        """Coefficients in OpenCV's order, of a fisheye k1 to k4; zeros in place of none, which OpenCV does not take."""
        return [float(value) for value in self.intrinsics.distortion or [0.0] * (4 if self.is_fisheye else 5)]

    @property
    def focal(self) -> tuple[float, float]:
        """Focal lengths fx, fy in pixels."""
        (fx, _, _), (_, fy, _), _ = self.intrinsics.matrix
        return fx, fy

    @property
    def principal(self) -> tuple[float, float]:
        """Principal point cx, cy in pixels, pixel centres at integers."""
        (_, _, cx), (_, _, cy), _ = self.intrinsics.matrix
        return cx, cy

    @property
    def size(self) -> tuple[int, int]:
        """Width, height in pixels."""
        width, height = self.camera.image_size
        return width, height

    @property
    def coefficients(self) -> dict[str, float]:
        """Distortion coefficients by their names in `COEFFICIENTS`, absent ones zero."""
        given = self.intrinsics.distortion
        return dict(zip(COEFFICIENTS, [*given, *[0.0] * (len(COEFFICIENTS) - len(given))], strict=True))

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix (3, 3), world to camera."""
        return matrix_of(self.pose.rotation)

    def require_support(self, name: str, supported: Collection[str]) -> None:
        """Refuse a lens with skew or coefficients that are not `supported`: without them points are pixels off."""
        model = self.intrinsics.model
        if model != "opencv":
            kind = "fisheye lens" if self.is_fisheye else f"{model} panorama"
            lacks = f"{name} has no place for the {kind} of camera {self.id}; json and st-map hold every lens."
            raise cannot_hold(self.id, lacks, [model])
        beyond = [key for key, value in self.coefficients.items() if value != 0 and key not in supported]
        if self.intrinsics.matrix[0][1] != 0:
            beyond.append("skew")
        if beyond:
            parts = f"{', '.join(beyond)} of the lens of camera {self.id}"
            raise cannot_hold(self.id, f"{name} has no place for {parts}; json and st-map hold every lens.", beyond)
