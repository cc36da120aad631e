"""The wire models: what crosses HTTP, what `esc` reads from files, and what a worker hands back.

World: right-handed, metres, origin at the pitch centre on z = 0, x along the touchline, y across the pitch, z up.
Cameras are OpenCV's: x right, y down, z forward, pixel centres at integers.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from itertools import pairwise
from typing import Annotated, Any, Literal, Self
from urllib.parse import urlsplit, urlunsplit

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    HttpUrl,
    RootModel,
    StringConstraints,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from fields.shapes import COLOUR_PATTERN, WHITE
from fields.template import NAMES, Extent, Template, load
from service.wire.schedule import next_time

ID_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
JOB_ID_PATTERN = r"^[0-9A-HJKMNP-TV-Z]{26}$"
OPTIONS_PART = "options"
PHOTOS_PART = "photos"
CHARUCO_PATTERN = r"^((4X4|5X5|6X6|7X7)_(50|100|250|1000)|ARUCO_ORIGINAL|APRILTAG_(16h5|25h9|36h10|36h11))$"
LensModel = Literal["opencv", "fisheye"]
DISTORTION_LENGTHS: dict[LensModel, tuple[int, ...]] = {"opencv": (0, 4, 5, 8, 12, 14), "fisheye": (0, 4)}
LARGEST_SIDE = 16384

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
JobId = Annotated[str, StringConstraints(pattern=JOB_ID_PATTERN)]
Name = Annotated[str, StringConstraints(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
# Finite, and a number: neither NaN, which Python's JSON reader lets through, nor true nor "1".
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Metres = Annotated[Number, Field(ge=-2000, le=2000)]
Radians = Annotated[Number, Field(ge=-10, le=10)]
Position = Annotated[list[Metres], Field(min_length=3, max_length=3)]
Rotation = Annotated[list[Radians], Field(min_length=3, max_length=3)]
Row = Annotated[list[Number], Field(min_length=3, max_length=3)]
Side = Annotated[Whole, Field(ge=32, le=LARGEST_SIDE)]
# Written as browsers understand it: 0x7f.1 is 127.0.0.1 from here on, for whoever looks at it.
CallbackUrl = Annotated[str, StringConstraints(max_length=1024), AfterValidator(lambda url: str(HttpUrl(url)))]


# Stands where user and password were in a source that is shown.
HIDDEN = "***"
SOURCE_SCHEMES = ("http", "https", "rtsp", "rtsps")


def _is_a_source(url: str) -> str:
    """Written as it is kept; an address with user or password in it is no reason to repeat them in an error."""
    try:
        parts = urlsplit(url)
        complete = parts.scheme in SOURCE_SCHEMES and parts.hostname and (parts.port is None or parts.port > 0)
    except ValueError:
        complete = False
    if not complete or not url.isascii() or not url.isprintable() or " " in url or "#" in url:
        raise ValueError(f"a source is an address that begins with one of {', '.join(SOURCE_SCHEMES)} and names a host")
    return url


SourceUrl = Annotated[str, StringConstraints(max_length=1024), AfterValidator(_is_a_source)]


def without_credentials(url: str) -> tuple[str, str | None]:
    """A source as it is shown, and what was before the `@`, None if there is none."""
    parts = urlsplit(url)
    userinfo, at, host = parts.netloc.rpartition("@")
    return (urlunsplit(parts._replace(netloc=f"{HIDDEN}@{host}")), userinfo) if at else (url, None)


class Wire(BaseModel):
    """A model of the interface: unknown fields are errors, not ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PoseIn(Wire):
    """Where a camera stands and looks: `rotation` and exactly one of `position` and `translation`."""

    rotation: Rotation = Field(description="Rodrigues vector, rad, world to camera.")
    position: Position | None = Field(None, description="Camera centre in the world, m.")
    translation: Position | None = Field(None, description="OpenCV's tvec = -R·position, m.")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.position is None) == (self.translation is None):
            raise ValueError("give exactly one of position and translation")
        return self


class Pose(Wire):
    """Where a camera stands and looks, in both conventions."""

    rotation: list[float] = Field(description="Rodrigues vector, rad, world to camera.")
    position: list[float] = Field(description="Camera centre in the world, m.")
    translation: list[float] = Field(description="OpenCV's tvec = -R·position, m.")

    @classmethod
    def at(cls, rotation: list[float], position: list[float]) -> Pose:
        """From rotation vector and camera centre."""
        translation = [-component for component in rotated(rotation, position)]
        return cls(rotation=rotation, position=position, translation=translation)

    @classmethod
    def of(cls, pose: PoseIn) -> Pose:
        """From a pose as it was sent."""
        if pose.position is not None:
            return cls.at(pose.rotation, pose.position)
        assert pose.translation is not None
        backwards = rotated([-component for component in pose.rotation], pose.translation)
        return cls(
            rotation=pose.rotation,
            position=[-component for component in backwards],
            translation=pose.translation,
        )


def rotated(rotation: list[float], vector: list[float]) -> list[float]:
    """A vector turned by a Rodrigues vector (rad): Rodrigues' formula."""
    angle = math.hypot(*rotation)
    if angle == 0.0:
        return list(vector)
    ax, ay, az = (component / angle for component in rotation)
    x, y, z = vector
    cos, sin = math.cos(angle), math.sin(angle)
    along = (ax * x + ay * y + az * z) * (1 - cos)
    return [
        x * cos + (ay * z - az * y) * sin + ax * along,
        y * cos + (az * x - ax * z) * sin + ay * along,
        z * cos + (ax * y - ay * x) * sin + az * along,
    ]


class Intrinsics(Wire):
    """The lens: OpenCV's camera matrix in pixels and its distortion coefficients in OpenCV's order."""

    model: LensModel = Field("opencv", description="`fisheye`: OpenCV's fisheye module (Kannala-Brandt).")
    matrix: Annotated[list[Row], Field(min_length=3, max_length=3)]
    distortion: Annotated[list[Annotated[Number, Field(ge=-1000, le=1000)]], Field(max_length=14)] = Field(
        description="0, 4, 5, 8, 12 or 14 numbers; of a fisheye 0 or 4."
    )

    @model_validator(mode="after")
    def _a_lens(self) -> Self:
        (fx, _, _), (lower, fy, _), last = self.matrix
        if lower != 0 or last != [0, 0, 1]:
            raise ValueError("matrix must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
        if fx <= 0 or fy <= 0:
            raise ValueError("focal lengths must be above 0 pixels")
        if len(self.distortion) not in DISTORTION_LENGTHS[self.model]:
            *most, last_length = DISTORTION_LENGTHS[self.model]
            expected = f"{', '.join(map(str, most))} or {last_length}"
            raise ValueError(f"distortion must have {expected} numbers with the model {self.model}")
        return self


class _Lens(Wire):
    """What a camera is, but for its pose."""

    id: Id
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] = Field(description="Width, height in pixels.")
    intrinsics: Intrinsics

    @model_validator(mode="after")
    def _plausible(self) -> Self:
        if self.id == OPTIONS_PART:
            raise ValueError("a camera cannot be called 'options': that is a part of the upload")
        (fx, _, cx), (_, fy, cy), _ = self.intrinsics.matrix
        width, height = self.image_size
        for focal, centre, size in ((fx, cx, width), (fy, cy, height)):
            # From wider than any fisheye to longer than any broadcast lens; a matrix of another resolution shows here.
            if not 0.1 * size <= focal <= 200 * size or not -size <= centre <= 2 * size:
                raise ValueError(f"the camera matrix does not belong to an image of {width}x{height} pixels")
        return self


class CameraIn(_Lens):
    """A camera of a venue as it is sent."""

    pose: PoseIn
    source: SourceUrl | None = Field(
        None,
        description="Where its frames can be fetched: the address of a JPEG or PNG, or an RTSP stream. User and "
        f"password are not shown again: `{HIDDEN}@` stands for them, and sent back keeps them.",
        examples=["http://user:password@10.1.0.7/snapshot.jpg"],
    )

    @model_validator(mode="after")
    def _above_the_pitch(self) -> Self:
        height = Pose.of(self.pose).position[2]
        if height <= 0:
            raise ValueError(
                f"camera {self.id} stands at z = {height:.6g} m: z points up, and a camera must be above the pitch"
            )
        return self


class PosedCamera(_Lens):
    """A camera as it stands: its lens, and where it is and looks."""

    pose: Pose


class Camera(PosedCamera):
    """A camera of a venue with its stored pose."""

    source: str | None = Field(None, description="Where its frames can be fetched.")

    @property
    def posed(self) -> PosedCamera:
        """What a calibration says of it, and nothing else."""
        return PosedCamera(id=self.id, image_size=self.image_size, intrinsics=self.intrinsics, pose=self.pose)


Place = Annotated[list[Annotated[Number, Field(ge=-200, le=200)]], Field(min_length=2, max_length=2)]
Length = Annotated[Number, Field(gt=0, le=400)]
PaintWidth = Annotated[Number, Field(ge=0.01, le=1)]
Colour = Annotated[str, StringConstraints(pattern=COLOUR_PATTERN)]
# Further than this beside the field nothing counts as a marking of it.
BESIDE_M = 2.0


class ArcIn(Wire):
    """Counter-clockwise, seen from above, around `centre` from `start` to `end`, all on the middle of the paint."""

    centre: Place
    start: Place
    end: Place

    @model_validator(mode="after")
    def _round(self) -> Self:
        first, last = math.dist(self.centre, self.start), math.dist(self.centre, self.end)
        if first == 0 or abs(first - last) > 0.01:
            raise ValueError(f"start is {first:.2f} m from the centre, end {last:.2f} m: one radius is needed")
        return self


class CircleIn(Wire):
    """A full circle, `radius_m` to the middle of the paint."""

    centre: Place
    radius_m: Length


class SpotIn(Wire):
    """A disc of paint."""

    centre: Place
    diameter_m: PaintWidth


class MarkingIn(Wire):
    """One thing painted, exactly one of `line`, `arc`, `circle` and `spot`; places are x, y from the centre, m."""

    name: Annotated[Name, Field(min_length=1)]
    line: Annotated[list[Place], Field(min_length=2, max_length=200)] | None = None
    arc: ArcIn | None = None
    circle: CircleIn | None = None
    spot: SpotIn | None = None
    width_m: PaintWidth | None = Field(None, description="Of the paint; absent: the field's `line_width_m`.")
    colour: Colour = Field(
        WHITE,
        description="Of the paint: white, yellow, black, blue, red, green, orange or `#rrggbb`.",
        examples=["yellow", "#0a5fa8"],
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if sum(shape is not None for shape in (self.line, self.arc, self.circle, self.spot)) != 1:
            raise ValueError(f"marking {self.name} must be exactly one of line, arc, circle and spot")
        if self.line and any(a == b for a, b in pairwise(self.line)):
            raise ValueError(f"marking {self.name} has the same point twice in a row")
        return self

    @property
    def entry(self) -> dict[str, Any]:
        """As `fields.template` reads it."""
        entry: dict[str, Any] = {"name": self.name, "colour": self.colour}
        entry |= {} if self.width_m is None else {"width": self.width_m}
        if self.circle:
            return entry | {"circle": {"centre": self.circle.centre, "radius": self.circle.radius_m}}
        if self.spot:
            return entry | {"spot": {"centre": self.spot.centre, "diameter": self.spot.diameter_m}}
        return entry | ({"arc": self.arc.model_dump()} if self.arc else {"line": self.line})


class Layout(Wire):
    """Markings of one's own in place of a template's name, and names for points of them."""

    markings: Annotated[list[MarkingIn], Field(min_length=1, max_length=500)]
    points: Annotated[dict[Annotated[Name, Field(min_length=1)], Place], Field(max_length=1000)] = {}


def _is_a_template(name: str) -> str:
    if name not in NAMES:
        raise ValueError(f"{name} is none of the templates {', '.join(NAMES)}, nor markings of your own")
    return name


TemplateName = Annotated[str, AfterValidator(_is_a_template), WithJsonSchema({"type": "string", "enum": list(NAMES)})]


# Of a field, and what a template calls them.
USUAL = {"length_m": "length", "width_m": "width", "line_width_m": "line"}


def _usual_need_not_be_given(schema: dict[str, Any]) -> None:
    schema["required"] = [name for name in schema["required"] if name not in USUAL]


class FieldOfPlay(Wire):
    """The pitch. `ridge`: the two ends of the roof's ridge (same y, same z), absent or null = flat."""

    model_config = ConfigDict(json_schema_extra=_usual_need_not_be_given)

    template: Annotated[
        Annotated[TemplateName, Tag("name")] | Annotated[Layout, Tag("layout")],
        Discriminator(lambda given: "name" if isinstance(given, str) else "layout"),
    ] = Field("football", description="The name of a sport's template, or markings of your own.")
    length_m: Length = Field(description="Along x; absent: the template's.")
    width_m: Length = Field(description="Along y; absent: the template's.")
    line_width_m: PaintWidth = Field(description="Absent: the template's.")
    measures_m: dict[str, Number] = Field({}, description="What else a template leaves open, by name.")
    ridge: Annotated[list[Row], Field(min_length=2, max_length=2)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _as_usual(cls, given: Any) -> Any:
        template = given.get("template", "football") if isinstance(given, dict) else None
        if not isinstance(template, str) or template not in NAMES:
            return given
        return {name: load(template).size[measure].default for name, measure in USUAL.items()} | given

    @field_validator(*USUAL)
    @classmethod
    def _as_the_sport_has_it(cls, given: float, info: ValidationInfo) -> float:
        template = info.data.get("template")
        if isinstance(template, str) and info.field_name:
            _must_lie(given, load(template).size[USUAL[info.field_name]], template)
        return given

    @field_validator("measures_m")
    @classmethod
    def _are_left_open(cls, given: dict[str, float], info: ValidationInfo) -> dict[str, float]:
        template = info.data.get("template")
        extents = load(template).size if isinstance(template, str) else {}
        others = {name: extent for name, extent in extents.items() if name not in USUAL.values()}
        for name, measure in given.items():
            if name not in others:
                raise ValueError(f"{name} is not among what the template leaves open: {', '.join(others) or 'nothing'}")
            _must_lie(measure, others[name], f"{template}, {name}")
        return given

    @model_validator(mode="after")
    def _a_field(self) -> Self:
        for shape in self.plan.markings(self.size):
            x, y = shape.reach
            if x > self.length_m / 2 + BESIDE_M or y > self.width_m / 2 + BESIDE_M:
                raise ValueError(
                    f"{shape.name} leaves the {self.length_m:g} x {self.width_m:g} m of the field, "
                    "whose centre is the origin"
                )
        return self

    @model_validator(mode="after")
    def _a_roof(self) -> Self:
        if self.ridge is None:
            return self
        (x1, y1, z1), (x2, y2, z2) = self.ridge
        if y1 != y2 or z1 != z2:
            raise ValueError("both ends of the ridge need the same y and the same z")
        if max(abs(x1), abs(x2)) >= self.length_m / 2 or abs(y1) >= self.width_m / 2:
            raise ValueError("the ridge must lie inside the pitch")
        if not 0 <= z1 <= 3:
            raise ValueError("the ridge must be 0 to 3 m high")
        return self

    @property
    def plan(self) -> Template:
        """Markings and named points."""
        if isinstance(self.template, str):
            return load(self.template)
        entries = [marking.entry for marking in self.template.markings]
        return Template(marking=entries, points=self.template.points)

    @property
    def size(self) -> dict[str, float]:
        """What the plan is drawn by."""
        return {"length": self.length_m, "width": self.width_m, "line": self.line_width_m, **self.measures_m}


def _must_lie(given: float, extent: Extent, what: str) -> None:
    if not extent.least <= given <= extent.most:
        raise ValueError(f"{what}: {extent.least:g} to {extent.most:g} m, not {given:g}")


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


ALARMS_EXAMPLE: dict[str, Any] = {
    "moved_since_last_px": 40,
    "rejected_in_a_row": 3,
    "not_calibrated_for_h": 24,
    "callback_url": "https://example.com/alarms",
}


class _Place(Wire):
    id: Id
    name: Name = ""
    field: FieldOfPlay


class LensFile(BaseModel):
    """The part of the file of a lens, as `esc intrinsics` writes it, that a camera needs."""

    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)]
    intrinsics: Intrinsics


class Site(_Place):
    """The file of a venue before its cameras have poses: the pitch, and the cameras that are known."""

    cameras: list[CameraIn] = []


class Alarms(Wire):
    """When to sound the alarm about a venue; each rule may be left out."""

    model_config = ConfigDict(json_schema_extra={"examples": [ALARMS_EXAMPLE]})

    moved_since_last_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A calibration moves the pitch in the picture of a camera by more than this."
    )
    moved_since_first_px: Annotated[Number, Field(gt=0)] | None = Field(
        None, description="A camera's picture is further than this from where the camera was put."
    )
    rejected_in_a_row: Annotated[Whole, Field(ge=1, le=1000)] | None = Field(
        None, description="So many calibrations one after the other are rejected or fail."
    )
    not_calibrated_for_h: Annotated[Number, Field(gt=0, le=10000)] | None = Field(
        None, description="No poses are accepted for so many hours."
    )
    callback_url: CallbackUrl | None = Field(
        None, description="Told when an alarm begins and when it is over, signed (Standard Webhooks)."
    )


class Schedule(Wire):
    """When the service calibrates a venue by itself, with frames from the sources of its cameras."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"cron": "*/15 6-23 * * *", "time_zone": "Europe/Berlin"}]}
    )

    cron: Annotated[str, StringConstraints(max_length=100)] = Field(
        description="Cron's five fields: minute, hour, day, month, day of the week."
    )
    time_zone: Annotated[str, StringConstraints(max_length=64)] = Field("UTC", description="A name of IANA's.")

    @model_validator(mode="after")
    def _fires(self) -> Self:
        next_time(self.cron, self.time_zone, datetime.now(UTC))
        return self


class VenueIn(_Place):
    """A venue as it is sent."""

    model_config = ConfigDict(json_schema_extra={"examples": [VENUE_EXAMPLE]})

    cameras: Annotated[list[CameraIn], Field(min_length=1, max_length=32)]
    alarms: Alarms | None = None
    schedule: Schedule | None = None

    @model_validator(mode="after")
    def _can_be_fetched(self) -> Self:
        blind = [camera.id for camera in self.cameras if camera.source is None]
        if self.schedule is not None and blind:
            raise ValueError(f"a schedule needs a source of every camera, and {', '.join(blind)} has none")
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
            Camera(
                id=c.id,
                image_size=c.image_size,
                intrinsics=c.intrinsics,
                pose=Pose.of(c.pose),
                source=None if c.source is None else without_credentials(c.source)[0],
            )
            for c in self.cameras
        ]
        given = {"alarms": self.alarms, "schedule": self.schedule}
        return Venue(id=self.id, name=self.name, field=self.field, cameras=cameras, **given)


class Venue(_Place):
    """A venue with the poses that hold now."""

    cameras: list[Camera]
    alarms: Alarms | None = None
    schedule: Schedule | None = None

    @property
    def poses(self) -> dict[str, Pose]:
        """Where each camera stands and looks, by its id."""
        return {camera.id: camera.pose for camera in self.cameras}

    @property
    def posed(self) -> list[PosedCamera]:
        """What calibrations say of the cameras, and nothing else."""
        return [camera.posed for camera in self.cameras]

    def with_poses(self, poses: dict[str, Pose]) -> Venue:
        """The same venue, cameras moved."""
        cameras = [camera.model_copy(update={"pose": poses.get(camera.id, camera.pose)}) for camera in self.cameras]
        return self.model_copy(update={"cameras": cameras})

    def with_result(self, result: Result) -> Venue:
        """The same venue as an accepted calibration found it: poses, and the lenses and the ridge they belong to."""
        found = {camera.id: camera for camera in result.cameras}
        cameras = [
            camera.model_copy(
                update={
                    "pose": found[camera.id].pose,
                    "intrinsics": found[camera.id].intrinsics or camera.intrinsics,
                }
            )
            if camera.id in found
            else camera
            for camera in self.cameras
        ]
        field = self.field if result.ridge is None else self.field.model_copy(update={"ridge": result.ridge})
        return self.model_copy(update={"cameras": cameras, "field": field})

    def with_field(self, result: FieldResult) -> Venue:
        """The same venue as an accepted field fit found it: the pitch, and the poses around it."""
        poses = {camera.id: camera.pose for camera in result.cameras}
        return self.with_poses(poses).model_copy(update={"field": result.field})

    def sent(self) -> VenueIn:
        """The venue as one sends it."""
        cameras = [
            CameraIn(
                id=c.id,
                image_size=c.image_size,
                intrinsics=c.intrinsics,
                pose=PoseIn(rotation=c.pose.rotation, position=c.pose.position),
                source=c.source,
            )
            for c in self.cameras
        ]
        given = {"alarms": self.alarms, "schedule": self.schedule}
        return VenueIn(id=self.id, name=self.name, field=self.field, cameras=cameras, **given)

    def with_state(self, cameras: list[PosedCamera], ridge: list[list[float]] | None) -> Venue:
        """The same venue with the poses and lenses of another time, and the ridge that they belong to."""
        then = {camera.id: camera for camera in cameras}
        back = [
            camera.model_copy(update={"pose": then[camera.id].pose, "intrinsics": then[camera.id].intrinsics})
            for camera in self.cameras
        ]
        field = FieldOfPlay.model_validate(self.field.model_dump() | {"ridge": ridge})
        return self.model_copy(update={"cameras": back, "field": field})

    def stands_like(self, other: Venue) -> bool:
        """Whether the cameras of both are the same and stand alike, with the ridge that their poses belong to."""
        return self.posed == other.posed and self.field.ridge == other.field.ridge

    def calibrates_like(self, other: Venue) -> bool:
        """Whether a calibration of the one is a calibration of the other: same pitch, lenses and stored poses."""
        return self.field == other.field and self.posed == other.posed

    def films_like(self, other: Venue) -> bool:
        """Whether frames of the one are frames of the other: same pitch and lenses, wherever the cameras stand."""
        return self.calibrates_like(other.with_poses(self.poses))


class Venues(Wire):
    """A page of venues, by id. `next_cursor`: null on the last page."""

    venues: list[Venue]
    next_cursor: str | None = None


class Moved(Wire):
    """From the stored pose to the new one; `pixels`: mean shift of the visible pitch."""

    rotation_deg: float
    position_m: float
    pixels: float | None


class Movement(Wire):
    """How a camera stands against others of its states; null: there was none, or it is not known."""

    moved: Moved | None = Field(description="Since the revision before.")
    drift: Moved | None = Field(description="Since the revision `drift_since`.")
    drift_since: int = Field(description="The last revision in which the camera was put where it is: the first pose.")


class RevisionCamera(Movement):
    """A camera in a revision of its venue."""

    id: Id
    pose: Pose


# What brought a revision: a PUT, a calibration by itself, a result that was accepted by hand, an older revision.
Cause = Literal["put", "calibrated", "accepted", "restored"]


class Revision(Wire):
    """The poses that a venue had from a moment on, with the lenses and the ridge that they belong to."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "revision": 2,
                    "at": "2026-11-21T10:00:09Z",
                    "cause": "calibrated",
                    "job": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
                    "restored_from": None,
                    "stitch_error_px": 0.2,
                    "ridge": [[-18.5, 0.0, 0.2367], [18.5, 0.0, 0.2367]],
                    "cameras": [
                        {
                            "id": "left",
                            "pose": {
                                "rotation": [1.675, 0.372, -0.462],
                                "position": [-1.48, -49.49, 7.84],
                                "translation": [-20.06, 3.73, 45.85],
                            },
                            "moved": {"rotation_deg": 0.1, "position_m": 0.02, "pixels": 4.1},
                            "drift": {"rotation_deg": 0.1, "position_m": 0.02, "pixels": 4.1},
                            "drift_since": 1,
                        }
                    ],
                }
            ]
        }
    )

    revision: int = Field(description="Counts from 1; the newest holds now.")
    at: datetime
    cause: Cause
    job: str | None = Field(description="Whose poses these are; of a restored one, whose were rejected by hand.")
    restored_from: int | None = Field(description="The revision that was put back.")
    stitch_error_px: float | None = Field(description="As the job said; null: nobody measured it.")
    ridge: list[Row] | None
    cameras: list[RevisionCamera]


class History(Wire):
    """A page of revisions, newest first. `next_cursor`: null on the last page."""

    revisions: list[Revision]
    next_cursor: int | None = None


AlarmRule = Literal["moved-since-last", "moved-since-first", "rejected-in-a-row", "not-calibrated"]


class Alarm(Wire):
    """An alarm that rings, of one camera or (null) of the whole venue."""

    rule: AlarmRule
    camera: Id | None
    since: datetime
    why: str


class ScheduleState(Wire):
    """When a venue is calibrated next, and what came of the last time."""

    next_at: datetime
    last_job: str | None
    last_error: str | None = Field(description="Why the last time brought no job.")


class VenueHealth(Wire):
    """How a venue is doing. `state` is `alarm` while one of its alarms rings."""

    state: Literal["ok", "alarm"]
    alarms: list[Alarm]
    revision: int = Field(description="The one that holds.")
    cameras: list[RevisionCamera] = Field(description="Where they stand, and how far that is from where they were put.")
    stitch_error_px: float | None = Field(description="Of the poses that hold, by the last result.")
    accepted_at: datetime | None = Field(description="When poses were last accepted.")
    rejected_in_a_row: int = Field(description="Calibrations that were rejected or failed since then.")
    schedule: ScheduleState | None = None


class VenueAlarm(Alarm):
    """An alarm with its venue."""

    venue: Id


class AlarmEvent(Wire):
    """What the `callback_url` of a venue's alarms gets, at least once: an alarm began, or is over.

    Every attempt has the same `webhook-id`.
    """

    type: Literal["alarm.began", "alarm.ended"]
    timestamp: datetime = Field(description="When it began or ended.")
    data: VenueAlarm


class Restore(Wire):
    """Which revision is to hold again."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"revision": 1}]})

    revision: Annotated[Whole, Field(ge=1, le=2**31 - 1)]


class Options(Wire):
    """What a caller may choose; everything is optional."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"preset": "esc", "seed": 7, "dry_run": True}]})

    preset: Literal["esc", "paper", "scpr"] = "esc"
    seed: Annotated[Whole, Field(ge=0, le=2**53 - 1)] | None = Field(None, description="Absent: one is chosen.")
    generations: Annotated[Whole, Field(ge=1, le=2000)] = Field(100, description="G of the paper.")
    parents: Annotated[Whole, Field(ge=2, le=4096)] = Field(64, description="μ of the paper.")
    offspring: Annotated[Whole, Field(ge=2, le=8192)] = Field(128, description="λ of the paper's strategy.")
    stitch_weight: Annotated[Number, Field(ge=0, le=1)] = Field(0.5, description="The paper's trade-off λ.")
    flat: Flag = Field(False, description="Calibrate on a plane although the venue has a ridge.")
    fit_focal_length: Flag = Field(False, description="Find each camera's focal length too: heat changes it.")
    fit_ridge: Flag = Field(False, description="Find the height of the field's ridge too.")
    dry_run: Flag = Field(False, description="Never move the stored poses.")
    priority: Literal["live", "routine"] = "routine"
    timeout_s: Annotated[Number, Field(ge=1, le=3600)] | None = Field(None, description="Absent: the service's.")
    callback_url: CallbackUrl | None = Field(None, description="Told of the job's end, signed (Standard Webhooks).")

    @model_validator(mode="after")
    def _fits_with_the_finish(self) -> Self:
        if (self.fit_focal_length or self.fit_ridge) and self.preset != "esc":
            raise ValueError("fit_focal_length and fit_ridge need preset esc: the others end without a finish")
        if self.fit_ridge and self.flat:
            raise ValueError("fit_ridge and flat contradict each other")
        return self


class _Handling(Wire):
    """How a job is to be treated, whatever it computes."""

    priority: Literal["live", "routine"] = "routine"
    timeout_s: Annotated[Number, Field(ge=1, le=3600)] | None = Field(None, description="Absent: the service's.")
    callback_url: CallbackUrl | None = Field(None, description="Told of the job's end, signed (Standard Webhooks).")


class Charuco(Wire):
    """What a ChArUco board has beside its squares."""

    dictionary: Annotated[str, StringConstraints(pattern=CHARUCO_PATTERN)] = Field(
        description="OpenCV's name without DICT_, for instance 4X4_50."
    )
    marker_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a marker, m.")


class Board(Wire):
    """A chessboard or ChArUco board: columns and rows are its inner corners, where four squares meet."""

    columns: Annotated[Whole, Field(ge=3, le=100)]
    rows: Annotated[Whole, Field(ge=3, le=100)]
    square_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a square, m.")
    charuco: Charuco | None = None

    @model_validator(mode="after")
    def _markers_in_squares(self) -> Self:
        if self.charuco is not None and self.charuco.marker_m >= self.square_m:
            raise ValueError("marker_m must be below square_m: a marker lies inside a square")
        return self


class IntrinsicsOptions(_Handling):
    """What photos show, and which lens to look for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"board": {"columns": 9, "rows": 6, "square_m": 0.03}}]})

    board: Board
    model: LensModel = "opencv"


Coordinates = Annotated[list[Metres], Field(min_length=2, max_length=3)]
Landmark = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class ClickedPoint(Wire):
    """A point of the pitch in a camera's picture: its name or [x, y] or [x, y, z] in metres, and its pixel."""

    world: Landmark | Coordinates
    pixel: Annotated[list[Number], Field(min_length=2, max_length=2)]


class ClickedPoints(RootModel[dict[Id, Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]]]):
    """A file of clicked points, by camera."""


class LocateOptions(_Handling):
    """Points of the pitch that somebody clicked in the picture of a camera."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "points": [
                        {"world": "left near corner", "pixel": [128.3, 1141.1]},
                        {"world": "left penalty area, near corner", "pixel": [939.6, 1053.9]},
                        {"world": "left penalty area, far corner", "pixel": [1771.6, 813.2]},
                        {"world": [0.0, 0.0], "pixel": [2796.7, 876.0]},
                    ]
                }
            ]
        }
    )

    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]


class FieldOptions(_Handling):
    """How the measures of a pitch are to be fitted; everything is optional."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"seed": 7}]})

    seed: Annotated[Whole, Field(ge=0, le=2**53 - 1)] | None = Field(None, description="Absent: one is chosen.")


class Progress(Wire):
    """How far a running job has come: `fraction` 0..1 of the whole."""

    stage: Literal["segmentation", "evolution", "refinement", "preview", "detection", "fit"]
    fraction: float = Field(ge=0, le=1)
    generation: int | None = None
    loss: float | None = None


class Sigma(Wire):
    """One standard deviation of a pose."""

    rotation_deg: float
    position_m: float


class CameraResult(Wire):
    """One camera's answer."""

    id: Id
    pose: Pose
    intrinsics: Intrinsics | None = Field(None, description="With fit_focal_length: those the pose belongs to.")
    sigma: Sigma | None
    repeatability: Sigma | None = Field(
        None, description="The part of sigma that the lens and the field, the same the next time, have no part in."
    )
    moved: Moved
    iou: float | None
    residual_px: float | None


class Provenance(Wire):
    """What it takes to compute the same numbers again."""

    software: str
    model_sha256: str
    seed: int
    options: dict[str, Any]


class Suspicion(Wire):
    """A number of a camera's lens, or of the field (camera null), that the lines contradict.

    It seems to be larger than the venue says by `deviation` ± `sigma`, in the unit that `quantity` ends on.
    """

    camera: Id | None
    quantity: str
    deviation: float
    sigma: float
    detail: str


class Result(Wire):
    """Poses and what they are worth. Stitch errors: 1 px is 10 cm on the pitch; one camera has none."""

    accepted: bool
    rejected_because: str | None
    cameras: list[CameraResult]
    ridge: list[Row] | None = Field(None, description="With fit_ridge: as it was found.")
    diagnosis: list[Suspicion] = Field([], description="What the lines say is wrong with what the venue says.")
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    stitch_error_limit_px: float | None = Field(None, description="What the gate lets pass at most.")
    loss: float | None
    generations: int
    timings_s: dict[str, float]
    provenance: Provenance


class PhotoResult(Wire):
    """What became of a photo. `left_out_px`: how well a lens that was fitted without it foretells its corners (rms)."""

    name: str
    fate: Literal["used", "no-board", "wrong-size", "hurts"]
    rms_px: float | None
    left_out_px: float | None
    blurred: bool


class CoverageResult(Wire):
    """How much of the picture the board reached; `empty`: the ninths of it without any corner."""

    share: float
    empty: list[str]


class LensTrial(Wire):
    """A lens that was tried, by its free numbers; rms of the photos it was fitted to and of those it was not."""

    terms: list[str]
    rms_px: float
    left_out_px: float


class IntrinsicsResult(Wire):
    """A lens from photos of a board, and what it is worth.

    `sigma`: one standard deviation of each number if every corner were an independent witness; `spread`: by leaving
    out photos, which is nearer to the truth. `warnings` say what to photograph next.
    """

    image_size: list[int]
    intrinsics: Intrinsics
    terms: list[str]
    rms_px: float
    left_out_px: float
    sigma: dict[str, float]
    spread: dict[str, float]
    coverage: CoverageResult
    photos: list[PhotoResult]
    trials: list[LensTrial]
    warnings: list[str]
    timings_s: dict[str, float]
    software: str


class PointResult(Wire):
    """What became of a click. `exchanged_with`: the point whose label explains it, and it theirs.

    `looks_like`: the named point it is on instead. `residual_px`: null where the camera cannot see its point.
    """

    world: Landmark | Coordinates
    residual_px: float | None
    doubted: bool
    exchanged_with: Landmark | Coordinates | None
    looks_like: str | None


class LensGain(Wire):
    """Numbers of the lens that were fitted to the points because the one given does not fit them.

    `left_out_px`: rms of points, each where a fit to the others puts it. `evidence`: the gain in BIC; 10 is strong.
    """

    given: Intrinsics
    free: list[str]
    sigma: dict[str, float]
    rms_before_px: float
    rms_px: float
    left_out_before_px: float
    left_out_px: float
    evidence: float


class LocateSigma(Wire):
    """One standard deviation of a first pose; `pixels`: of where it puts the clicked points."""

    rotation_deg: float
    position_m: float
    pixels: float


class LocateResult(Wire):
    """A first pose. `accepted`: a calibration can begin with it; `intrinsics` are those that it holds with."""

    accepted: bool
    rejected_because: str | None
    camera: Id
    image_size: list[int]
    intrinsics: Intrinsics
    pose: Pose
    rms_px: float
    sigma: LocateSigma
    points: list[PointResult]
    lens: LensGain | None
    warnings: list[str]
    timings_s: dict[str, float]
    software: str


class MeasureResult(Wire):
    """A measure of the pitch, metres: as the venue has it (`given`) and as the lines have it (`value` ± `sigma`).

    `open`: one standard deviation of what it might have been before. `known`: whether the lines tell it; if not,
    `detail` says why, and the fitted field keeps what was given.
    """

    name: Literal["length_m", "width_m", "ridge_height_m", "ridge_length_m"]
    given: float
    value: float
    sigma: float
    open: float
    known: bool
    detail: str


class FieldResult(Wire):
    """A pitch with the measures that its lines tell, and the cameras as they stand around it.

    `accepted`: it may replace the one that the venue has; nothing is replaced by itself.
    """

    accepted: bool
    rejected_because: str | None
    field: FieldOfPlay
    measures: list[MeasureResult]
    cameras: list[CameraResult]
    stitch_error_px: float | None
    timings_s: dict[str, float]
    provenance: Provenance


class JobError(Wire):
    """Why a job failed: the members of a problem (RFC 9457)."""

    type: str
    title: str
    detail: str
    camera: str | None = None


class CallbackState(Wire):
    """How far the telling of a job's end has come, once it has ended; `callback_url` in the options asked for it."""

    state: Literal["waiting", "delivered", "given-up"]
    attempts: int = Field(description="Begun so far.")
    last_error: str | None = Field(description="Why the last attempt that failed did.")
    next_attempt_at: datetime | None = Field(description="Null unless waiting.")


# Of files that poses leave in; `service.formats.table` has what is behind the names.
FormatName = Literal["json", "opencv", "opentrackio", "freed", "colmap", "soccernet", "st-map", "st-map-unreal"]

# What a key allows; each one includes those before it.
Scope = Literal["read", "calibrate", "admin"]

Kind = Literal["calibration", "intrinsics", "locate", "field"]
Status = Literal["queued", "running", "succeeded", "failed", "cancelled"]
OPEN: tuple[Status, ...] = ("queued", "running")


class Job(Wire):
    """What a worker computes: its state, how far it is, and in the end its result, of its kind, or its error."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
                    "kind": "calibration",
                    "venue": "tsukuba",
                    "status": "running",
                    "progress": {"stage": "evolution", "fraction": 0.42, "generation": 37, "loss": 0.31},
                    "queue_position": None,
                    "attempt": 1,
                    "created_at": "2026-11-21T10:00:00Z",
                    "started_at": "2026-11-21T10:00:01Z",
                    "finished_at": None,
                    "error": None,
                    "result": None,
                    "callback": None,
                    "venue_revision": None,
                    "links": {"self": "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"},
                }
            ]
        }
    )

    id: str
    kind: Kind = "calibration"
    venue: str | None = Field(description="Null for the intrinsics of a lens, which belong to no venue.")
    status: Status
    progress: Progress | None
    queue_position: int | None = Field(description="1 = next; null unless queued.")
    attempt: int = Field(description="How often the job was begun; above 1 after a crash of its worker.")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    error: JobError | None
    result: Result | IntrinsicsResult | LocateResult | FieldResult | None
    callback: CallbackState | None = Field(
        None, description="Null before the end, without `callback_url`, and in what a `callback_url` gets."
    )
    venue_revision: int | None = Field(
        None, description="The revision of the venue that its poses became, by themselves or by hand; null: none."
    )
    links: dict[str, str]

    @property
    def open(self) -> bool:
        """Whether anything can still change."""
        return self.status in OPEN


class JobEvent(Wire):
    """What a `callback_url` gets, at least once: a job has ended. Its id is the `webhook-id` of every attempt."""

    type: Literal["job.succeeded", "job.failed", "job.cancelled"]
    timestamp: datetime = Field(description="When the job ended.")
    data: Job

    @classmethod
    def of(cls, job: Job) -> JobEvent:
        """The event of an ended job."""
        told = job.model_copy(update={"callback": None})
        return cls.model_validate({"type": f"job.{job.status}", "timestamp": job.finished_at, "data": told})


class Jobs(Wire):
    """A page of jobs, newest first. `next_cursor`: null on the last page."""

    jobs: list[Job]
    next_cursor: str | None = None


class Health(Wire):
    """`ok`, or per part what is wrong with it."""

    status: Literal["ok", "unavailable"]
    parts: dict[str, str] = {}


class ProblemDetails(BaseModel):
    """RFC 9457. Beside these members a problem carries the part that is wrong: camera, expected, got, job, errors."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/frame-size",
                    "title": "The frame does not have the size of the camera",
                    "status": 422,
                    "detail": "Send camera left in 3840x2160 pixels, the size of its intrinsics.",
                    "camera": "left",
                    "expected": [3840, 2160],
                    "got": [1920, 1080],
                }
            ]
        },
    )

    type: str
    title: str
    status: int
    detail: str
