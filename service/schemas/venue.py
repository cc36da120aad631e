"""Models of a venue in requests and answers: a pitch and the cameras around it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from service.schemas import source_urls
from service.schemas.addresses import HIDDEN, SourceUrl, hide_path, restore_url
from service.schemas.base import OPEN_WORD, UNREADABLE, Id, Name, Number, Schema, Unreadable, is_empty, is_none
from service.schemas.encoders import LensEncoders
from service.schemas.events.webhooks import WEBHOOK_EXAMPLE, Webhook
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, Pose, PosedCamera, PoseIn, UnposedCamera, check_lens, require_above_pitch
from service.schemas.health import Alarm, Alarms, CalibrationEnd
from service.schemas.options import Options
from service.schemas.schedule import Schedule
from service.schemas.view import VIEW_EXAMPLE, ViewChoice

T = TypeVar("T", Alarms | None, Options | None)
Accept = Annotated[
    Literal["each", "all"],
    OPEN_WORD,
    Field(description="Poses that a calibration stores: `each` that passes the gate, or `all` only if all pass."),
]
Lens = Annotated[
    Literal["fixed", "may-drift"],
    OPEN_WORD,
    Field(
        description="Handling of cameras whose zoom or focus moved: `fixed` rejects the pose, `may-drift` accepts it "
        "with the focal length that was found."
    ),
]
Recover = Annotated[
    Literal["propose", "accept"],
    OPEN_WORD,
    Field(
        description="Handling of a camera that was knocked by more than 8 degrees or 1.5 m and found again: `propose` "
        "rejects the pose until somebody accepts the job, `accept` stores it at once."
    ),
]

Webhooks = Annotated[
    list[Webhook], Field(max_length=8, description="Addresses that get events of the venue, such as new poses.")
]


Pixel = Annotated[list[Number], Field(min_length=2, max_length=2)]
Polygon = Annotated[list[Pixel], Field(min_length=3, max_length=200)]
Ignore = Annotated[
    list[Polygon],
    Field(
        max_length=50,
        description="Areas of the frame to ignore, polygons of [x, y] in pixels: nothing in them is detected, measured "
        "or expected.",
        examples=[[[[0, 1900], [900, 1900], [900, 2159], [0, 2159]]]],
    ),
]

LIGHT = "Photometric correction for stitched views; accepted calibrations measure it and change it slowly."
ENCODERS = "Tables of its zoom and focus for FreeD; null: their counts are 0."


class CameraIn(UnposedCamera):
    """A camera of a venue in a request."""

    pose: PoseIn
    ignore: Ignore = Field([])
    light: Light | None = Field(None, description=LIGHT)
    encoders: LensEncoders | None = Field(None, description=ENCODERS)
    source: SourceUrl | None = Field(
        None,
        description="Address of its frames: a JPEG or PNG, motion JPEG, or an RTSP stream. User and password, also in "
        f"parameters such as `pwd=`, are shown as `{HIDDEN}`; sending `{HIDDEN}` back keeps them. Certificates of "
        "https and rtsps are verified; `#tls_sha256=` and its SHA-256 accept one that the camera signed itself.",
        examples=["http://user:password@10.1.0.7/snapshot.jpg"],
    )

    @model_validator(mode="after")
    def _has_a_usable_lens(self) -> Self:
        check_lens(self.intrinsics, self.image_size)
        return self

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
        require_above_pitch(f"camera {self.id}", Pose.from_input(self.pose).position[2])
        return self


class Camera(PosedCamera):
    """A camera of a venue with its stored pose."""

    ignore: Ignore = Field([])
    light: Light | None = Field(None, description=LIGHT)
    encoders: LensEncoders | None = Field(None, exclude_if=is_none, description=ENCODERS)
    # Old versions stored parameters that count as secret now.
    source: Annotated[str, AfterValidator(source_urls.hide_secrets)] | None = Field(
        None, description="Address of its frames, without secrets."
    )

    @property
    def posed(self) -> PosedCamera:
        """Id, image size, lens and pose of the camera."""
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
                "sigma": {"fx": 2.0, "fy": 2.0, "cx": 3.0, "cy": 3.0, "k1": 0.002, "k2": 0.003},
            },
            "pose": {"rotation": [1.675, 0.372, -0.462], "position": [-1.48, -49.49, 7.84]},
        }
    ],
}


PATCH_EXAMPLES: dict[str, Any] = {
    "an alarm": {"value": {"alarms": {"rejected_in_a_row": 3}}},
    "a webhook for new poses": {"value": {"webhooks": [WEBHOOK_EXAMPLE]}},
    "no schedule": {"value": {"schedule": None}},
    "settings of the stitched view": {"value": {"view": VIEW_EXAMPLE}},
    "the source of a camera": {"value": {"cameras": {"left": {"source": "http://10.1.0.7/snapshot.jpg"}}}},
}


def require_distinct_ids(ids: Sequence[str]) -> None:
    """Raise `ValueError` where two cameras of a venue have the same id."""
    if len(set(ids)) < len(ids):
        raise ValueError("two cameras have the same id")


class NamedField(Schema):
    """Id, name and field of a venue."""

    id: Id = Field(description="Id of the venue.")
    name: Name = Field("", description="Name for people.")
    field: FieldOfPlay


class Site(NamedField):
    """A venue file that may not have cameras yet."""

    cameras: list[CameraIn] = Field([])


class VenueSettings(NamedField):
    """A venue without the type of its cameras."""

    cameras: list[Any] = Field(description="Cameras around the field.")
    accept: Accept = "each"
    lens: Lens = "fixed"
    recover: Recover = "propose"
    alarms: Alarms | None = None
    schedule: Schedule | None = None
    webhooks: Webhooks = Field([])
    view: ViewChoice | None = Field(
        None, description="Settings of its stitched view; null: chosen to suit the cameras."
    )

    def with_cameras(self, parts: Mapping[str, Mapping[str, Any]], **others: Any) -> Self:
        """Return the venue with other `parts` of the named cameras, and with `others` of its own."""
        cameras = [camera.model_copy(update=parts.get(camera.id)) for camera in self.cameras]
        return self.model_copy(update={"cameras": cameras, **others})


class VenueIn(VenueSettings):
    """A venue in a request."""

    model_config = ConfigDict(json_schema_extra={"examples": [VENUE_EXAMPLE]})

    cameras: Annotated[list[CameraIn], Field(min_length=1, max_length=32)] = Field(
        description="Cameras around the field."
    )
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
        require_distinct_ids([camera.id for camera in self.cameras])
        return self

    @property
    def secrets(self) -> dict[str, source_urls.SourceSecrets]:
        """Return the secrets in the source of each camera, as they were sent."""
        return {
            camera.id: source_urls.secrets_of(camera.source) for camera in self.cameras if camera.source is not None
        }

    def to_venue(self) -> "Venue":
        """Return the venue with poses in both conventions."""
        cameras = [Camera(**dict(camera) | {"pose": Pose.from_input(camera.pose)}) for camera in self.cameras]
        parts = {name: value for name, value in self if name != "warnings"}
        return Venue(**parts | {"cameras": cameras})


class Venue(VenueSettings):
    """A venue with its current poses."""

    cameras: list[Camera] = Field(description="Cameras around the field, with their current poses.")

    @property
    def has_sources(self) -> bool:
        """True if the service can fetch a frame of every camera by itself."""
        return all(camera.source for camera in self.cameras)

    @property
    def poses(self) -> dict[str, Pose]:
        """Poses by camera."""
        return {camera.id: camera.pose for camera in self.cameras}

    @property
    def lights(self) -> dict[str, Light]:
        """Photometric corrections by camera, of the cameras that have one."""
        return {camera.id: camera.light for camera in self.cameras if camera.light is not None}

    @property
    def lens_warnings(self) -> list[str]:
        """Warnings about the lenses of its cameras, a line each."""
        # Imported late: NumPy loads slowly, and most readers of venues do not need it.
        from service.schemas.lens_map import lens_warnings

        zooms = [(camera, camera.encoders.zoom) for camera in self.cameras if camera.encoders]
        doubts = [words for camera, zoom in zooms if zoom for words in zoom.doubts(camera)]
        return [*(words for camera in self.cameras for words in lens_warnings(camera)), *doubts]

    @property
    def poses_and_lenses(self) -> list[PosedCamera]:
        """Cameras without the uncertainty of their lenses, for comparing venues."""
        return [camera.posed.pose_and_lens for camera in self.cameras]

    @property
    def callbacks(self) -> list[str]:
        """URLs of all webhooks and callbacks of the venue."""
        parts = (self.alarms, None if self.schedule is None else self.schedule.options)
        others = [part.callback_url for part in parts if part is not None and part.callback_url is not None]
        return [webhook.url for webhook in self.webhooks] + others

    def with_hidden_callbacks(self) -> Self:
        """Return the venue for an answer: URLs of callbacks are shortened, since their paths may be secret."""
        return self._with_callbacks(hide_path)

    def with_callbacks_of(self, before: "Venue | None") -> Self:
        """Return the venue with shortened URLs of callbacks replaced by the full ones that it had before."""
        known = [] if before is None else before.callbacks
        return self._with_callbacks(lambda url: restore_url(url, known))

    def _with_callbacks(self, change: Callable[[str], str]) -> Self:
        def changed(part: T) -> T:
            url = None if part is None or part.callback_url is None else change(part.callback_url)
            return part if part is None else part.model_copy(update={"callback_url": url})

        schedule = self.schedule and self.schedule.model_copy(update={"options": changed(self.schedule.options)})
        webhooks = [webhook.model_copy(update={"url": change(webhook.url)}) for webhook in self.webhooks]
        return self.model_copy(update={"alarms": changed(self.alarms), "schedule": schedule, "webhooks": webhooks})

    def to_input(self) -> VenueIn:
        """Return the venue as a request has it."""
        once = {"cameras": {"__all__": {"pose": {"translation"}}}}
        return VenueIn.model_validate(self.model_dump(exclude=once))

    def changed_parts(self, other: "Venue") -> list[str]:
        """Return the names of the fields that differ from another venue's."""
        return [name for name in type(self).model_fields if getattr(self, name) != getattr(other, name)]

    def has_same_poses_as(self, other: "Venue") -> bool:
        """True if both have the same cameras with the same poses and lenses, and the same ridge."""
        return self.poses_and_lenses == other.poses_and_lenses and self.field.ridge == other.field.ridge

    def has_same_calibration_input_as(self, other: "Venue") -> bool:
        """True if both have the same field, lenses and poses, so that a calibration of one is one of the other."""
        return self.field == other.field and self.poses_and_lenses == other.poses_and_lenses

    def accepts_frames_of(self, other: "Venue") -> bool:
        """True if frames of the other can be calibrated here: same field, cameras and lenses, whatever their poses."""
        return self.has_same_calibration_input_as(
            other.with_cameras({camera: {"pose": pose} for camera, pose in self.poses.items()})
        )


class ChangedVenue(Venue):
    """A venue after PUT or PATCH, with warnings."""

    warnings: list[str] = Field(
        [],
        description="Warnings about poses that do not see the field, with the convention that would explain them. "
        "Others are about lenses without a `sigma`, without rays for a part of the picture, or of another resolution, "
        "and about a field of default size without a `sigma`. Not stored: GET does not show them, PUT ignores them.",
        examples=[
            [
                "camera west: its lens has no sigma and is taken to be as sure as a good board leaves it, "
                "0.03 % of the focal length"
            ]
        ],
    )

    @classmethod
    def of(cls, venue: Venue, pose_warnings: list[str]) -> "ChangedVenue":
        """Return the answer to a change of a venue."""
        return cls(**dict(venue), warnings=pose_warnings + venue.lens_warnings + venue.field.warnings)


class RestoredVenue(Venue):
    """A venue after a revision was restored, with warnings."""

    warnings: list[str] = Field(
        [],
        exclude_if=is_empty,
        description="Data that the restored revision no longer has; absent if nothing was lost. Not stored.",
        examples=[["the nights that cameras left, right remember are dropped: revision 1 has none any more"]],
    )


class VenueSummary(Schema):
    """Summary of a venue: name, cameras, active alarms and last calibration."""

    id: Id = Field(description="Id of the venue.")
    name: Name = Field(description="Name for people.")
    cameras: list[Id] = Field(description="Ids of its cameras.")
    scheduled: bool = Field(description="True if it has a schedule.")
    state: Annotated[Literal["ok", "alarm"], OPEN_WORD] = Field(description="`alarm` while one of `alarms` is active.")
    alarms: list[Alarm] = Field(description="Active alarms.")
    last: CalibrationEnd | None = Field(description="Last calibration that ended; null: none yet.")


class Venues(Schema):
    """A page of venues."""

    venues: list[Venue] = Field(description="Venues, by id.")
    summaries: list[VenueSummary] | None = Field(
        None, exclude_if=is_none, description="Only with `fields=summary`, and then instead of `venues`."
    )
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: str | None = Field(None, description="`cursor` of the next page; null on the last.")
