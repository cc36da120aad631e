"""Models of a plan: cameras that are not mounted yet, and what a calibration would make of them."""

from math import atan, degrees
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from service.schemas.addresses import SourceUrl
from service.schemas.base import OPEN_WORD, Id, Integer, Number, Schema
from service.schemas.field import PitchPoint
from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.geometry import (
    Intrinsics,
    Light,
    PoseIn,
    Position,
    Side,
    check_lens,
    require_above_pitch,
    require_camera_id,
)
from service.schemas.results import Sigma
from service.schemas.venue import Ignore, VenueSettings, require_distinct_ids

LineStateName = Literal["fresh", "worn", "night"]
HiddenShare = Annotated[float, Field(ge=0, le=0.9, allow_inf_nan=False)]
PlanPicture = Literal["place", "pixels-per-metre", "coverage"]
# Of lenses without distortion.
NARROWEST_DEG, WIDEST_DEG = 2.0, 150.0
Angle = Annotated[Number, Field(ge=-360, le=360)]
Millimetres = Annotated[Number, Field(gt=0, le=10_000)]


class PlannedCameraIn(Schema):
    """A camera that is to be mounted: a place, a direction, a lens and an image size.

    The direction is `look_at`, or `pan_deg` and `tilt_deg`; `pose` replaces place and direction. The lens is
    `field_of_view_deg`, `focal_length_mm` with `sensor_width_mm`, or `intrinsics`.
    """

    id: Id = Field(description="Id of the camera.")
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] = Field(description="Width, height in pixels.")
    position: Position | None = Field(None, description="Place of the camera, m.", examples=[[-1.0, -48.0, 12.0]])
    look_at: PitchPoint | None = Field(
        None, description="Point [x, y] of the field in the middle of the picture, m.", examples=[[-24.0, -6.0]]
    )
    pan_deg: Angle | None = Field(None, description="Pan: 0 looks along y, positive to the right.")
    tilt_deg: Annotated[Number, Field(ge=-89.9, le=89.9)] | None = Field(None, description="Tilt: negative looks down.")
    roll_deg: Angle = Field(0.0, description="Roll, clockwise seen from behind the camera.")
    pose: PoseIn | None = Field(None, description="Pose of a camera that stands already.")
    intrinsics: Intrinsics | None = Field(None, description="Lens that was calibrated already.")
    field_of_view_deg: Annotated[Number, Field(ge=NARROWEST_DEG, le=WIDEST_DEG)] | None = Field(
        None, description="Horizontal field of view of a lens without distortion."
    )
    focal_length_mm: Millimetres | None = Field(None, description="Focal length of a lens without distortion.")
    sensor_width_mm: Millimetres | None = Field(None, description="Width of its sensor.")
    ignore: Ignore = Field([])
    light: Light | None = Field(None, description="Ignored: a venue is a valid plan.")
    source: SourceUrl | None = Field(None, description="Ignored: a venue is a valid plan.")

    @model_validator(mode="after")
    def _has_one_direction(self) -> Self:
        require_camera_id(self.id)
        by_angles = self.pan_deg is not None and self.tilt_deg is not None
        half = (self.pan_deg is None) != (self.tilt_deg is None)
        ways = [self.pose is not None, self.look_at is not None, by_angles]
        if half or sum(ways) != 1:
            raise ValueError(f"camera {self.id} needs one direction: look_at, pan_deg with tilt_deg, or a pose")
        if (self.position is None) != (self.pose is not None):
            raise ValueError(f"camera {self.id} needs one place: position, or the one of its pose")
        if self.position is not None:
            require_above_pitch(f"camera {self.id}", self.position[2])
        if self.look_at is not None and self.position is not None and self.look_at == self.position[:2]:
            raise ValueError(f"camera {self.id} looks straight down: give pan_deg and tilt_deg in place of look_at")
        return self

    @model_validator(mode="after")
    def _has_one_lens(self) -> Self:
        by_sensor = self.focal_length_mm is not None and self.sensor_width_mm is not None
        half = (self.focal_length_mm is None) != (self.sensor_width_mm is None)
        if half or sum([self.intrinsics is not None, self.field_of_view_deg is not None, by_sensor]) != 1:
            raise ValueError(
                f"camera {self.id} needs one lens: field_of_view_deg, focal_length_mm with sensor_width_mm, or "
                "intrinsics"
            )
        if self.intrinsics is not None:
            check_lens(self.intrinsics, self.image_size)
        view_deg = self.pinhole_view_deg
        if view_deg is not None and not NARROWEST_DEG <= view_deg <= WIDEST_DEG:
            raise ValueError(
                f"camera {self.id}: expected a field of view of {NARROWEST_DEG:g} to {WIDEST_DEG:g} degrees, "
                f"focal_length_mm and sensor_width_mm make {view_deg:.4g}"
            )
        return self

    @property
    def pinhole_view_deg(self) -> float | None:
        """Horizontal field of view of a lens without distortion; None if `intrinsics` are the lens."""
        if self.focal_length_mm is None or self.sensor_width_mm is None:
            return self.field_of_view_deg
        return 2 * degrees(atan(self.sensor_width_mm / 2 / self.focal_length_mm))


class StandIn(Schema):
    """A place for several cameras, whose directions and lens are to be proposed."""

    id: Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_-]{0,60}$")] = Field(
        description="Its cameras are called `id-1`, `id-2` and so on, from left to right."
    )
    position: Position = Field(description="Place of the stand, m.")
    cameras: Annotated[Integer, Field(ge=1, le=8)] = Field(description="Number of its cameras.")
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] = Field(description="Width, height in pixels.")
    overlap_deg: Annotated[Number, Field(ge=0, le=30)] = Field(5.0, description="Common view of two neighbours.")

    @model_validator(mode="after")
    def _above_the_pitch(self) -> Self:
        require_above_pitch(f"stand {self.id}", self.position[2])
        return self


class PlannedSite(VenueSettings):
    """A field and the cameras that are to be mounted around it; a whole venue is one, too."""

    id: Id = Field("plan", description="Id of the venue to come.")
    cameras: Annotated[list[PlannedCameraIn], Field(max_length=32)] = Field(
        [], description="Cameras that are to be mounted."
    )
    stands: Annotated[list[StandIn], Field(max_length=8)] = Field(
        [], description="Places for cameras whose directions and lenses are to be proposed."
    )
    warnings: list[str] = Field([], exclude=True, description="Ignored: a venue is a valid plan.")

    @model_validator(mode="after")
    def _cameras_differ(self) -> Self:
        proposed = [f"{stand.id}-{number}" for stand in self.stands for number in range(1, stand.cameras + 1)]
        require_distinct_ids([*(camera.id for camera in self.cameras), *proposed])
        if not self.cameras and not self.stands:
            raise ValueError("a plan needs cameras, or stands to propose cameras for")
        return self

    def to_sought(self, planned: "PlanResult") -> SoughtSite:
        """Return the site for a search once the cameras are mounted: what is planned of each, and what is known."""
        known = {camera.id: camera for camera in self.cameras}
        return SoughtSite(
            id=self.id,
            name=self.name,
            field=self.field,
            cameras=[_sought(one, known.get(one.id)) for one in planned.cameras],
        )


def _sought(planned: "PlannedCameraResult", given: PlannedCameraIn | None) -> SoughtCameraIn:
    lens = None if given is None else given.intrinsics
    return SoughtCameraIn(
        id=planned.id,
        image_size=planned.image_size,
        intrinsics=lens,
        field_of_view_deg=None if planned.field_of_view_deg is None or lens else max(planned.field_of_view_deg, 5.0),
        position=planned.position,
        # A mast that is put up beside its place.
        position_radius_m=3.0,
        ignore=[] if given is None else given.ignore,
    )


class PlanRequest(Schema):
    """Request of the program that plans cameras: a site, and what its lines are expected to be like."""

    site: PlannedSite
    lines: LineStateName
    hidden: HiddenShare


class Spread(Schema):
    """Values over the field in view: the `median`, and `worst`, which only 5 % of it exceed."""

    median: float = Field(description="Median over the field in view.")
    worst: float = Field(description="The value that only 5 % of the field in view exceed.")


class PlaceChange(Schema):
    """Sigma of places on the ground, m, before and after a change: rms over the field in view."""

    before_m: float = Field(description="Before the change, m.")
    after_m: float = Field(description="After the change, m.")


class DecisiveMarkingResult(Schema):
    """A marking, its length that is measured, and the sigma of places on the ground without it."""

    marking: str = Field(description="Name of the marking.")
    measured_m: float = Field(description="Length that is measured of it, m.")
    without: PlaceChange = Field(description="Change of `calibration_m` without it.")


class PlannedCameraResult(Schema):
    """Plan of a camera."""

    id: Id = Field(description="Id of the camera.")
    image_size: list[int] = Field(description="Width, height in pixels.")
    position: list[float] = Field(description="Place, m.")
    pan_deg: float = Field(description="Pan: 0 looks along y, positive to the right.")
    tilt_deg: float = Field(description="Tilt: negative looks down.")
    field_of_view_deg: float | None = Field(
        description="Horizontal field of view; null: the lens has no rays at the edges of its picture."
    )
    calibratable: bool = Field(description="False if the quality gate would refuse its poses.")
    share_of_field: float = Field(description="Share of the field in view, 0..1.")
    sigma: Sigma = Field(description="Expected sigma of its pose, for the lens as given.")
    refined_sigma: Sigma = Field(description="Expected sigma of its refined pose, found together with the lens.")
    measurement_sigma: Sigma = Field(description="The same if lens and field were known exactly.")
    place_m: Spread | None = Field(
        description="Expected sigma of a player's place on the ground: by the calibration, and by the unevenness of "
        "the ground; null: no ground of the field is in view."
    )
    calibration_m: Spread | None = Field(description="The part of `place_m` by pose, lens and field.")
    px_per_metre: Spread | None = Field(description="Pixels per metre across the line of sight; `worst`: the least.")
    px_per_metre_along: Spread | None = Field(description="Pixels per metre of ground along the line of sight.")
    decisive_markings: list[DecisiveMarkingResult] = Field(
        description="Markings that it measures, by `calibration_m` without them; the one it can least do without first."
    )
    one_metre_higher: PlaceChange | None = Field(description="Change of `place_m` by one more metre of height.")


class PlannedPairResult(Schema):
    """Plan of two cameras that see some of the same ground."""

    cameras: Annotated[list[Id], Field(min_length=2, max_length=2)] = Field(description="Ids of the two cameras.")
    overlap_m2: float = Field(description="Ground of the field that both see, m².")
    stitch_m: float = Field(description="Expected distance between the places where they put the same ground, rms, m.")
    markings_m: dict[str, float] = Field(description="Length that both measure of each marking, m.")
    five_degrees_more_m: float | None = Field(
        description="`stitch_m` if both were turned towards each other by 5 degrees in all; null: no common ground."
    )


class PlanWarningResult(Schema):
    """Warning about a plan. `cameras`: empty if it is about the field."""

    kind: str = Field(description="Kind of warning, a stable word.")
    cameras: list[Id] = Field(description="Ids of the cameras that it is about.")
    detail: str = Field(description="The warning in words, and what to do.")


class PlanResult(Schema):
    """Expected calibration of planned cameras: sigmas, coverage, overlap, what decides them, and warnings."""

    lines: Annotated[LineStateName, OPEN_WORD] = Field(description="State of the lines that the plan is for.")
    hidden: float = Field(description="Share of the lines that something covers, 0..1.")
    place_m: Spread | None = Field(description="Sigma of a player's place by the camera that knows it best.")
    covered: dict[int, float] = Field(description="Share of the field by the number of cameras that see it.")
    cameras: list[PlannedCameraResult] = Field(description="Each camera.")
    pairs: list[PlannedPairResult] = Field(description="Each two cameras that see some of the same ground.")
    warnings: list[PlanWarningResult] = Field(description="Faults of the plan.")

    @property
    def calibratable(self) -> bool:
        """True if the quality gate would refuse none of the cameras."""
        return all(camera.calibratable for camera in self.cameras)


Rows = list[list[float | None]]


class CameraMaps(Schema):
    """Maps of one camera; null where it does not see the field."""

    place_m: Rows = Field(description="Sigma of a player's place, m.")
    calibration_m: Rows = Field(description="The part of it by pose, lens and field, m.")
    px_per_metre: Rows = Field(description="Pixels per metre across the line of sight.")
    px_per_metre_along: Rows = Field(description="Pixels per metre of ground along the line of sight.")


class PlanMaps(Schema):
    """Maps of a plan, row by row from the far touchline."""

    x_m: list[float] = Field(description="Centres of the columns, m.")
    y_m: list[float] = Field(description="Centres of the rows, m.")
    place_m: Rows = Field(description="Sigma of a player's place by the camera that knows it best, m.")
    px_per_metre: Rows = Field(description="Pixels per metre in the camera that resolves a place best.")
    coverage: list[list[int]] = Field(description="Number of cameras that see a cell.")
    cameras: dict[Id, CameraMaps] = Field(description="Maps of each camera, by its id.")


class PlanAnswer(Schema):
    """Plan of a site, with its maps."""

    plan: PlanResult = Field(description="Expected calibration.")
    maps: PlanMaps = Field(description="Maps of the field in numbers.")
    pictures: dict[str, str] = Field(
        description="The field from above as PNG files in base64: `place` (sigma of a player's place), "
        "`pixels-per-metre`, `coverage` (number of cameras)."
    )
