"""A venue as it is sent and as it is kept: a pitch and the cameras around it."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from service.wire.addresses import HIDDEN, SourceUrl, without_credentials
from service.wire.base import Id, Name, Number, Wire
from service.wire.field import FieldOfPlay
from service.wire.geometry import Light, Pose, PosedCamera, PoseIn, UnposedCamera
from service.wire.health import Alarms
from service.wire.schedule import Schedule
from service.wire.told.webhooks import WEBHOOK_EXAMPLE, Webhook
from service.wire.view import VIEW_EXAMPLE, ViewChoice

Accept = Annotated[
    Literal["each", "all"],
    Field(description="Of a calibration: `each` pose that passes the gate, or `all` of them if all do and else none."),
]
Lens = Annotated[
    Literal["fixed", "may-drift"],
    Field(
        description="Of cameras whose zoom or focus moved: `fixed` rejects the pose, `may-drift` accepts it with the "
        "focal length that was found."
    ),
]

Webhooks = Annotated[
    list[Webhook], Field(max_length=8, description="Told of what happens to the venue, and of new poses with them.")
]


Pixel = Annotated[list[Number], Field(min_length=2, max_length=2)]
Polygon = Annotated[list[Pixel], Field(min_length=3, max_length=200)]
Ignore = Annotated[
    list[Polygon],
    Field(
        max_length=50,
        description="Areas of the frame that are of no use, polygons of [x, y] in pixels: nothing in them counts as a "
        "marking, is measured or is missed.",
        examples=[[[[0, 1900], [900, 1900], [900, 2159], [0, 2159]]]],
    ),
]

# What the engine takes the focal length of a lens without a sigma to be known to, one standard deviation.
BOARD_FOCAL_PERCENT = 0.03
LIGHT = "How it is evened out with the others in a stitched view; accepted calibrations find it and keep it steady."


class CameraIn(UnposedCamera):
    """A camera of a venue as it is sent."""

    pose: PoseIn
    ignore: Ignore = Field([])
    light: Light | None = Field(None, description=LIGHT)
    source: SourceUrl | None = Field(
        None,
        description="Where its frames can be fetched: the address of a JPEG or PNG, or an RTSP stream. User and "
        f"password are not shown again: `{HIDDEN}@` stands for them, and sent back keeps them.",
        examples=["http://user:password@10.1.0.7/snapshot.jpg"],
    )

    @model_validator(mode="after")
    def _ignores_what_is_in_its_picture(self) -> Self:
        width, height = self.image_size
        for x, y in (corner for polygon in self.ignore for corner in polygon):
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                raise ValueError(
                    f"ignore: the corner ({x:g}, {y:g}) lies outside the {width}x{height} pixels of camera {self.id}"
                )
        return self

    @model_validator(mode="after")
    def _above_the_pitch(self) -> Self:
        height = Pose.of(self.pose).position[2]
        if height <= 0:
            raise ValueError(
                f"camera {self.id} stands at z = {height:.6g} m: z points up, and a camera must be above the pitch"
            )
        return self


class Camera(PosedCamera):
    """A camera of a venue with its stored pose."""

    ignore: Ignore = Field([])
    light: Light | None = Field(None, description=LIGHT)
    source: str | None = Field(None, description="Where its frames can be fetched.")

    @property
    def posed(self) -> PosedCamera:
        """What a calibration says of it, and nothing else."""
        return PosedCamera(id=self.id, image_size=self.image_size, intrinsics=self.intrinsics, pose=self.pose)


VENUE_EXAMPLE: dict[str, Any] = {
    "id": "tsukuba",
    "name": "University pitch",
    "field": {
        "template": "football",
        "length_m": 105.0,
        "width_m": 68.0,
        "line_width_m": 0.12,
        "ridge": [[-18.5, 0.0, 0.2367], [18.5, 0.0, 0.2367]],
    },
    "cameras": [
        {
            "id": "left",
            "image_size": [3072, 1728],
            "intrinsics": {
                "matrix": [[2122.4, 0, 1634.8], [0, 2122.4, 877.7], [0, 0, 1]],
                "distortion": [-0.3402, 0.1042, 0, 0, 0],
            },
            "pose": {"rotation": [1.675, 0.372, -0.462], "position": [-1.48, -49.49, 7.84]},
        }
    ],
}


PATCH_EXAMPLES: dict[str, Any] = {
    "an alarm": {"value": {"alarms": {"rejected_in_a_row": 3}}},
    "who is told of new poses": {"value": {"webhooks": [WEBHOOK_EXAMPLE]}},
    "no schedule": {"value": {"schedule": None}},
    "what its stitched view shows": {"value": {"view": VIEW_EXAMPLE}},
    "the source of a camera": {"value": {"cameras": {"left": {"source": "http://10.1.0.7/snapshot.jpg"}}}},
}


class _Place(Wire):
    id: Id
    name: Name = ""
    field: FieldOfPlay


class Site(_Place):
    """The file of a venue before its cameras have poses: the pitch, and the cameras that are known."""

    cameras: list[CameraIn] = Field([])


class VenueIn(_Place):
    """A venue as it is sent."""

    model_config = ConfigDict(json_schema_extra={"examples": [VENUE_EXAMPLE]})

    cameras: Annotated[list[CameraIn], Field(min_length=1, max_length=32)]
    accept: Accept = "each"
    lens: Lens = "fixed"
    alarms: Alarms | None = None
    schedule: Schedule | None = None
    webhooks: Webhooks = Field([])
    view: ViewChoice | None = Field(None, description="What its stitched view shows; null: what suits the cameras.")
    warnings: list[str] = Field(
        [], exclude=True, description="Ignored: so that what answers a PUT can be put again as it is."
    )

    @model_validator(mode="after")
    def _can_be_fetched(self) -> Self:
        blind = [camera.id for camera in self.cameras if camera.source is None]
        if self.schedule is not None and blind:
            have = "has" if len(blind) == 1 else "have"
            raise ValueError(f"a schedule needs a source of every camera, and {', '.join(blind)} {have} none")
        return self

    @model_validator(mode="after")
    def _cameras_differ(self) -> Self:
        ids = [camera.id for camera in self.cameras]
        if len(set(ids)) < len(ids):
            raise ValueError("two cameras have the same id")
        return self

    @property
    def credentials(self) -> dict[str, str | None]:
        """User and password of each camera's source, as they were sent."""
        return {c.id: without_credentials(c.source)[1] for c in self.cameras if c.source is not None}

    def stored(self) -> Venue:
        """The venue with poses in both conventions."""
        cameras = [
            Camera(**dict(c) | {"pose": Pose.of(c.pose), "source": c.source and without_credentials(c.source)[0]})
            for c in self.cameras
        ]
        parts = {name: value for name, value in self if name != "warnings"}
        return Venue(**parts | {"cameras": cameras})


class Venue(_Place):
    """A venue with the poses that hold now."""

    cameras: list[Camera]
    accept: Accept = "each"
    lens: Lens = "fixed"
    alarms: Alarms | None = None
    schedule: Schedule | None = None
    webhooks: Webhooks = Field([])
    view: ViewChoice | None = Field(None, description="What its stitched view shows; null: what suits the cameras.")

    @property
    def poses(self) -> dict[str, Pose]:
        """Where each camera stands and looks, by its id."""
        return {camera.id: camera.pose for camera in self.cameras}

    @property
    def lights(self) -> dict[str, Light]:
        """How cameras are evened out with the others, by the ids of those of which it is known."""
        return {camera.id: camera.light for camera in self.cameras if camera.light is not None}

    @property
    def lens_warnings(self) -> list[str]:
        """A line for each camera whose lens is taken to be well known because nobody said how well it is."""
        return [
            f"camera {camera.id}: its lens has no sigma and is taken to be as sure as a good board leaves it, "
            f"{BOARD_FOCAL_PERCENT:g} % of the focal length"
            for camera in self.cameras
            if not camera.intrinsics.sigma
        ]

    @property
    def standing(self) -> list[PosedCamera]:
        """Where the cameras stand and how they image: the same, however well their lenses are known."""
        return [camera.posed.standing for camera in self.cameras]

    def with_poses(self, poses: dict[str, Pose]) -> Venue:
        """The same venue, cameras moved."""
        cameras = [camera.model_copy(update={"pose": poses.get(camera.id, camera.pose)}) for camera in self.cameras]
        return self.model_copy(update={"cameras": cameras})

    def sent(self) -> VenueIn:
        """The venue as one sends it."""
        once = {"cameras": {"__all__": {"pose": {"translation"}}}}
        return VenueIn.model_validate(self.model_dump(exclude=once))

    def differs_in(self, other: Venue) -> list[str]:
        """The parts of the venue that are not as those of another one."""
        return [name for name in type(self).model_fields if getattr(self, name) != getattr(other, name)]

    def stands_like(self, other: Venue) -> bool:
        """Whether the cameras of both are the same and stand alike, with the ridge that their poses belong to."""
        return self.standing == other.standing and self.field.ridge == other.field.ridge

    def calibrates_like(self, other: Venue) -> bool:
        """Whether a calibration of the one is a calibration of the other: same pitch, lenses and stored poses."""
        return self.field == other.field and self.standing == other.standing

    def films_like(self, other: Venue) -> bool:
        """Whether frames of the one are frames of the other: same pitch and lenses, wherever the cameras stand."""
        return self.calibrates_like(other.with_poses(self.poses))


class ChangedVenue(Venue):
    """A venue as it was put or patched, with what it leaves to be assumed."""

    warnings: list[str] = Field(
        [],
        description="Of lenses without a `sigma`. Not kept: GET does not show it, and PUT takes it and ignores it.",
        examples=[
            [
                "camera west: its lens has no sigma and is taken to be as sure as a good board leaves it, "
                "0.03 % of the focal length"
            ]
        ],
    )

    @classmethod
    def of(cls, venue: Venue) -> ChangedVenue:
        """The answer to whoever changed a venue."""
        return cls(**dict(venue), warnings=venue.lens_warnings)


class Venues(Wire):
    """A page of venues, by id. `next_cursor`: null on the last page."""

    venues: list[Venue]
    next_cursor: str | None = None
