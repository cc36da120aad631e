"""Input of a search for cameras, and the venue that is made of its result."""

from collections.abc import Collection, Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.schemas.addresses import SourceUrl
from service.schemas.base import OPEN_WORD, Id, Number, Schema
from service.schemas.geometry import Intrinsics, PoseIn, Position, Side, require_camera_id
from service.schemas.names import Panorama
from service.schemas.options import FindOptions
from service.schemas.results import CandidateResult, FindResult
from service.schemas.venue import Camera, CameraIn, Ignore, NamedField, Venue, VenueIn, require_distinct_ids

WIDEST_DEG, WIDEST_PANORAMA_DEG = 150, 358
FieldSide = Annotated[
    Literal["near", "far", "left", "right"],
    OPEN_WORD,
    Field(description="Side of the field that a camera stands on: near is y < 0, far y > 0, left x < 0, right x > 0."),
]


class SoughtCameraIn(Schema):
    """A camera whose pose is searched for. Whatever is known about it makes the search faster and more reliable."""

    id: Id = Field(description="Id of the camera; its frames are parts of this name.")
    image_size: Annotated[list[Side], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Width, height in pixels. Absent: the size of its frame."
    )
    intrinsics: Intrinsics | None = Field(
        None,
        description="Lens of the camera. The focal length is searched for, too, if the `sigma` of `fx` is above 2 %. "
        "Absent: lens and pose are found together.",
    )
    panorama: Annotated[Panorama, OPEN_WORD] | None = Field(
        None,
        description="Surface of a stitched picture whose lens is not known. Without `field_of_view_deg`, views of 119° "
        "to 202° are tried.",
    )
    field_of_view_deg: Annotated[Number, Field(ge=5, le=WIDEST_PANORAMA_DEG)] | None = Field(
        None,
        description="Approximate horizontal field of view of an unknown lens, 150° at most unless it is a `panorama`: "
        "focal lengths within 30 % are tried, of a panorama within 10 %.",
    )
    pose: PoseIn | None = Field(None, description="Pose of a camera that need not be found.")
    position: Position | None = Field(None, description="Approximate position, m: within `position_radius_m`.")
    position_radius_m: Annotated[Number, Field(gt=0, le=1000)] = Field(
        10.0, description="Largest distance from `position`, m."
    )
    side: FieldSide | None = None
    ignore: Ignore = Field([])
    source: SourceUrl | None = Field(None, description="Address of its frames; only for a stored venue.")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        require_camera_id(self.id)
        if self.intrinsics is not None and self.field_of_view_deg is not None:
            raise ValueError(f"camera {self.id} has intrinsics and field_of_view_deg: leave one of them out")
        if self.intrinsics is not None and self.panorama is not None:
            raise ValueError(f"camera {self.id} has intrinsics and panorama: leave one of them out")
        if self.panorama is None and (self.field_of_view_deg or 0) > WIDEST_DEG:
            raise ValueError(
                f"camera {self.id} sees {self.field_of_view_deg:g}°: {WIDEST_DEG}° at most for one lens; say which "
                "panorama (cylindrical, equirectangular) a stitched picture is"
            )
        if self.pose is not None and (self.intrinsics is None or self.image_size is None):
            raise ValueError(f"camera {self.id} has a pose, so it needs its intrinsics and image_size, too")
        if self.intrinsics is not None and self.image_size is None:
            raise ValueError(f"camera {self.id} has intrinsics, which belong to an image_size: give that, too")
        return self


class SoughtSite(NamedField):
    """A venue whose cameras may lack poses and lenses, as the part `site` of a request has it."""

    cameras: Annotated[list[SoughtCameraIn], Field(min_length=1, max_length=32)] = Field(
        description="Cameras of the venue; those without a pose are searched for."
    )

    @model_validator(mode="after")
    def _cameras_differ(self) -> Self:
        require_distinct_ids([camera.id for camera in self.cameras])
        return self

    @property
    def sought(self) -> list[str]:
        """Ids of the cameras to find: those without a pose."""
        return [camera.id for camera in self.cameras if camera.pose is None]

    @classmethod
    def of(cls, venue: Venue, options: FindOptions, with_frames: Collection[str]) -> "SoughtSite":
        """Return the site of a stored venue; the cameras of the options, or all that have frames, lose their poses."""
        sought = with_frames if options.cameras is None else options.cameras
        cameras = [_sought(one, options) if one.id in sought else _known(one) for one in venue.cameras]
        return cls(id=venue.id, name=venue.name, field=venue.field, cameras=cameras)

    def completed(self, result: FindResult, chosen: Mapping[str, CandidateResult]) -> VenueIn:
        """Return the venue of the known and found cameras, in the order of the site, with the ridge if one was found.

        `chosen`: the candidate for each found camera; a camera without one is left out. Raises `ValidationError` if no
        camera remains, or a candidate is not valid in a venue.
        """
        sizes = {camera.id: camera.image_size for camera in result.cameras}
        placed = [_placed(one, chosen.get(one.id), sizes.get(one.id)) for one in self.cameras]
        cameras = [one for one in placed if one is not None]
        field = self.field if result.ridge is None else self.field.changed({"ridge": result.ridge})
        return VenueIn(id=self.id, name=self.name, field=field, cameras=cameras)


def _sought(camera: Camera, options: FindOptions) -> SoughtCameraIn:
    """Return a stored camera as one to find, with the lens and position that the options keep."""
    sought = SoughtCameraIn(
        id=camera.id,
        image_size=camera.image_size,
        intrinsics=None if options.find_lens else camera.intrinsics,
        panorama=camera.intrinsics.panorama if options.find_lens else None,
        ignore=camera.ignore,
    )
    if options.position_radius_m is None:
        return sought
    near = {"position": camera.pose.position, "position_radius_m": options.position_radius_m}
    return sought.model_copy(update=near)


def _known(camera: Camera) -> SoughtCameraIn:
    pose = PoseIn(rotation=camera.pose.rotation, position=camera.pose.position)
    return SoughtCameraIn(
        id=camera.id, image_size=camera.image_size, intrinsics=camera.intrinsics, pose=pose, ignore=camera.ignore
    )


def _placed(camera: SoughtCameraIn, found: CandidateResult | None, size: list[int] | None) -> CameraIn | None:
    """Return a camera with its known or found pose; None if it is to be found and has no chosen candidate."""
    kept = {"id": camera.id, "ignore": camera.ignore, "source": camera.source}
    if camera.pose is not None:
        return CameraIn(**kept, image_size=camera.image_size, intrinsics=camera.intrinsics, pose=camera.pose)
    if found is None:
        return None
    pose = PoseIn(rotation=found.pose.rotation, position=found.pose.position)
    return CameraIn(**kept, image_size=size, intrinsics=found.intrinsics, pose=pose)
