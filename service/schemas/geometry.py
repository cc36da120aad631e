"""Models of poses, lenses and camera movements.

World: right-handed, metres, origin at the pitch centre on z = 0, x along the touchline, y across the pitch, z up.
Cameras are OpenCV's: x right, y down, z forward, pixel centres at integers.
"""

import math
from typing import Annotated, Self

from pydantic import BaseModel, Field, model_validator

from service.schemas.base import OPEN_WORD, Id, Integer, Number, Schema
from service.schemas.lens_limits import LARGEST_COEFFICIENT, LARGEST_SIGMA, LEAST_SIGMA
from service.schemas.names import OPTIONS_PART, PANORAMAS, LensModel, Panorama, SigmaSource
from service.schemas.rotation import rotate

DISTORTION_LENGTHS: dict[LensModel, tuple[int, ...]] = {
    "opencv": (0, 4, 5, 8, 12, 14),
    "fisheye": (0, 4),
    **dict.fromkeys(PANORAMAS, (0,)),
}
COEFFICIENTS: dict[LensModel, tuple[str, ...]] = {
    "opencv": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"),
    "fisheye": ("k1", "k2", "k3", "k4"),
    **dict.fromkeys(PANORAMAS, ()),
}
# Parameters of a camera matrix: both focal lengths, the ratio fy/fx, the principal point.
MATRIX_NUMBERS = ("fx", "fy", "aspect", "cx", "cy")
LARGEST_SIDE = 16384
# A position and a translation agree within this: rounding of decimal numbers stays below it.
AGREEING_M = 1e-6
# Largest distance from the centre of the field, m: 2000 m along each axis. Position and translation have the same
# length, so that a pose which is valid in one convention is valid in the other.
FARTHEST_M = 3465.0
Metres = Annotated[Number, Field(ge=-2000, le=2000)]
Radians = Annotated[Number, Field(ge=-10, le=10)]
Position = Annotated[
    list[Annotated[Number, Field(ge=-FARTHEST_M - 1, le=FARTHEST_M + 1)]], Field(min_length=3, max_length=3)
]
Rotation = Annotated[list[Radians], Field(min_length=3, max_length=3)]
Row = Annotated[list[Number], Field(min_length=3, max_length=3)]
Side = Annotated[Integer, Field(ge=32, le=LARGEST_SIDE)]
Deviation = Annotated[Number, Field(ge=LEAST_SIGMA, le=LARGEST_SIGMA)]


class PoseIn(Schema):
    """Pose of a camera: `rotation`, and `position` or `translation`, or both if they agree."""

    rotation: Rotation = Field(description="Rodrigues vector, rad, world to camera.")
    position: Position | None = Field(None, description="Camera centre in the world, m.")
    translation: Position | None = Field(None, description="OpenCV's tvec = -R·position, m.")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.position is None and self.translation is None:
            raise ValueError("give position or translation")
        away_m = round(math.hypot(*(self.position or self.translation or ())), 6)
        if away_m > FARTHEST_M:
            raise ValueError(f"the camera is {away_m:g} m from the middle of the field: {FARTHEST_M:g} m at most")
        if self.position is not None and self.translation is not None:
            apart = math.dist(Pose.from_position(self.rotation, self.position).translation, self.translation)
            if apart > AGREEING_M and math.dist(self.position, self.translation) <= AGREEING_M:
                raise ValueError(
                    "translation is the same as position: OpenCV's tvec is -R·position; leave out translation where "
                    "this is the place of the camera, and position where it is tvec"
                )
            if apart > AGREEING_M:
                raise ValueError(
                    f"translation is {apart:.3g} m from -R·position: leave out the one that is not meant to hold"
                )
        return self


class Pose(Schema):
    """Pose of a camera: rotation, and its place as position and as OpenCV's translation."""

    rotation: list[float] = Field(description="Rodrigues vector, rad, world to camera.")
    position: list[float] = Field(description="Camera centre in the world, m.")
    translation: list[float] = Field(description="OpenCV's tvec = -R·position, m.")

    @classmethod
    def from_position(cls, rotation: list[float], position: list[float]) -> "Pose":
        """Return the pose of a rotation vector (rad) and a camera centre (m)."""
        translation = [-component for component in rotate(rotation, position)]
        return cls(rotation=rotation, position=position, translation=translation)

    @classmethod
    def from_input(cls, pose: PoseIn) -> "Pose":
        """Return the pose of a request, whose numbers are kept to the last digit."""
        if pose.translation is None:
            assert pose.position is not None
            return cls.from_position(pose.rotation, pose.position)
        backwards = rotate([-component for component in pose.rotation], pose.translation)
        position = pose.position or [-component for component in backwards]
        return cls(rotation=pose.rotation, position=position, translation=pose.translation)


class Intrinsics(Schema):
    """The lens: OpenCV's camera matrix in pixels and its distortion coefficients in OpenCV's order."""

    model: Annotated[LensModel, OPEN_WORD] = Field(
        "opencv",
        description="`fisheye`: OpenCV's fisheye module (Kannala-Brandt). Pictures that were stitched: `cylindrical`, "
        "u = fx·θ + cx, v = fy·tan φ + cy, and `equirectangular`, v = fy·φ + cy. θ: angle about the camera's y axis, "
        "0 forward; φ: angle below the plane across that axis, rad. A tilted horizon is part of the pose.",
    )
    matrix: Annotated[list[Row], Field(min_length=3, max_length=3)] = Field(
        description="OpenCV's camera matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], pixels."
    )
    distortion: Annotated[
        list[Annotated[Number, Field(ge=-LARGEST_COEFFICIENT, le=LARGEST_COEFFICIENT)]], Field(max_length=14)
    ] = Field(description="0, 4, 5, 8, 12 or 14 coefficients; 0 or 4 for `fisheye`, none for panoramas.")
    sigma: dict[str, Deviation] | None = Field(
        None,
        description="Uncertainty of the lens: one standard deviation by parameter; fx, fy, cx and cy in pixels, aspect "
        "(fy/fx) and the coefficients (k1, k2, p1 ... in OpenCV's order) without unit. Parameters that are not named "
        "get the uncertainty of a good board calibration that covered the whole picture.",
        examples=[{"fx": 4.0, "fy": 4.0, "cx": 6.0, "cy": 5.0, "k1": 0.002, "k2": 0.004}],
        json_schema_extra={"propertyNames": {"enum": [*MATRIX_NUMBERS, *COEFFICIENTS["opencv"]]}},
    )
    sigma_from: Annotated[SigmaSource, OPEN_WORD] | None = Field(
        None,
        description="Data that `sigma` was estimated from, if calibrations use it again: `lines`, for a lens that a "
        "search found together with the pose. Calibrations see the same lines and treat such a lens as unknown, so "
        "that the sigma of a pose stays as large as the search's. Absent: photos of a board, or another independent "
        "measurement.",
    )

    @model_validator(mode="after")
    def _a_lens(self) -> Self:
        if self.model not in DISTORTION_LENGTHS:
            return self
        (fx, _, _), (lower, fy, _), last = self.matrix
        if lower != 0 or last != [0, 0, 1]:
            raise ValueError("matrix must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
        if fx <= 0 or fy <= 0:
            raise ValueError("focal lengths must be above 0 pixels")
        if len(self.distortion) not in DISTORTION_LENGTHS[self.model]:
            *most, last_length = DISTORTION_LENGTHS[self.model]
            expected = f"{', '.join(map(str, most))} or {last_length}" if most else last_length
            raise ValueError(f"distortion must have {expected} numbers with the model {self.model}")
        if self.panorama and self.matrix[0][1] != 0:
            raise ValueError(f"skew must be 0 with the model {self.model}, came {self.matrix[0][1]:g}")
        return self

    @model_validator(mode="after")
    def _sigma_of_this_lens(self) -> Self:
        if self.model not in COEFFICIENTS:
            return self
        known = (*MATRIX_NUMBERS, *COEFFICIENTS[self.model])
        unknown = [name for name in self.sigma or {} if name not in known]
        if unknown:
            raise ValueError(f"sigma has {', '.join(unknown)}: with the model {self.model} it takes {', '.join(known)}")
        return self

    @property
    def panorama(self) -> Panorama | None:
        """Model of the lens of a picture that was stitched onto a cylinder or a sphere; None for other lenses."""
        return next((model for model in PANORAMAS if model == self.model), None)

    @property
    def without_sigma(self) -> "Intrinsics":
        """The lens without its uncertainty, for comparing lenses."""
        return self.model_copy(update={"sigma": None, "sigma_from": None})

    def with_sigma_of(self, other: "Intrinsics") -> "Intrinsics":
        """Return this lens, with the uncertainty of `other` if both are the same lens."""
        return other if other.without_sigma == self.without_sigma else self


class Light(Schema):
    """Photometric correction of a camera, so that it matches the other cameras of a stitched view where they overlap.

    A value t of 0 to 255 becomes `gain` * 100 * (t / 100) ** (1 + `contrast`), times exp(`falloff` * r²), r from 0 in
    the middle of the frame to 1 in its corners.
    """

    gain: Annotated[list[Annotated[Number, Field(ge=0.25, le=4)]], Field(min_length=3, max_length=3)] = Field(
        description="Gain of red, green and blue.", examples=[[1.06, 1.0, 0.94]]
    )
    contrast: Annotated[Number, Field(ge=-0.5, le=0.5)] = Field(
        0.0, description="Exponent beyond 1 of the contrast curve."
    )
    falloff: Annotated[Number, Field(ge=-1, le=1)] = Field(
        0.0, description="Logarithm of the gain in the corners beside the middle."
    )
    reach: Annotated[Number, Field(ge=-3, le=3)] = Field(
        0.0, description="Logarithm of an extra weight of the camera, which moves its seams."
    )


def require_camera_id(camera_id: str) -> None:
    """Raise `ValueError` for an id that is reserved."""
    if camera_id == OPTIONS_PART:
        raise ValueError("a camera cannot be called 'options': that is a part of the upload")


def require_above_pitch(what: str, height_m: float) -> None:
    """Raise `ValueError` for a place on the ground or below it."""
    if height_m <= 0:
        raise ValueError(f"{what} stands at z = {height_m:.6g} m: z points up, and it must be above the pitch")


def check_lens(lens: Intrinsics, image_size: list[int]) -> None:
    """Raise `ValueError` for a lens in a request that has no rays for its picture; stored lenses were checked once."""
    if lens.model not in DISTORTION_LENGTHS:
        return
    try:
        # NumPy takes its time to load, and what is only read needs none of this.
        from service.schemas.lens_map import require_usable_lens
    except ModuleNotFoundError as missing:
        # The client that is installed alone comes without it. Then the service says what is no lens.
        if missing.name != "numpy":
            raise
    else:
        require_usable_lens(lens, image_size)


class UnposedCamera(Schema):
    """A camera without its pose: id, image size and lens."""

    id: Id = Field(description="Id of the camera; parts of uploads have this name.")
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] = Field(description="Width, height in pixels.")
    intrinsics: Intrinsics

    @model_validator(mode="after")
    def _plausible(self) -> Self:
        require_camera_id(self.id)
        (fx, _, cx), (_, fy, cy), _ = self.intrinsics.matrix
        width, height = self.image_size
        for focal, centre, size in ((fx, cx, width), (fy, cy, height)):
            # From wider than any fisheye to longer than any broadcast lens: focal lengths in millimetres fail here. A
            # matrix of another resolution only gets a warning (`lens_map`): the picture may be a crop.
            if not 0.1 * size <= focal <= 200 * size or not -size <= centre <= 2 * size:
                raise ValueError(f"the camera matrix does not belong to an image of {width}x{height} pixels")
        return self


class PosedCamera(UnposedCamera):
    """A camera with lens and pose."""

    pose: Pose

    @property
    def pose_and_lens(self) -> "PosedCamera":
        """The camera without the uncertainty of its lens."""
        return self.model_copy(update={"intrinsics": self.intrinsics.without_sigma})


class LensFile(BaseModel):
    """The part of a lens file of `esc intrinsics` that a camera needs."""

    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)]
    intrinsics: Intrinsics


class Moved(Schema):
    """Movement from one pose to another."""

    rotation_deg: float = Field(description="Angle between the two poses, degrees.")
    position_m: float = Field(description="Distance between the two positions, m.")
    pixels: float | None = Field(description="Mean shift of the visible pitch in the picture; null: none is in view.")


Homography = Annotated[list[Row], Field(min_length=3, max_length=3)]


class PictureMotion(Schema):
    """Motion of a camera's picture from an earlier revision of its pose to the one in use.

    Homographies map pixels (x, y, 1) of then to pixels of now, so that masks and zones can follow the camera: those on
    the pitch by `ground`, those on what is far away by `far`.
    """

    since: int = Field(description="The earlier revision.")
    revision: int = Field(description="The revision in use.")
    image_size: list[int] = Field(description="Width and height of the picture, pixels.")
    ground: Homography | None = Field(
        description="Of what lies on the ground; null where hardly any ground is in both pictures: draw anew."
    )
    ground_residual_px: float | None = Field(
        description="Largest distance between it and the cameras, pixels: lenses bend what a homography keeps straight."
    )
    far: Homography | None = Field(
        description="Of what is so far away that only the camera's rotation and zoom move it; null as above."
    )
    far_residual_px: float | None = Field(description="The same for `far`.")


class Movement(Schema):
    """Movement of a camera since earlier revisions; null: there was none, or it is unknown."""

    moved: Moved | None = Field(description="Movement since the previous revision.")
    drift: Moved | None = Field(description="Movement since the revision `drift_since`.")
    drift_since: int = Field(description="The last revision in which somebody set the camera's pose.")
