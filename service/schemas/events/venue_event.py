"""Events of a venue, as webhooks and event streams deliver them."""

from collections.abc import Collection
from datetime import datetime
from typing import Annotated, Literal, get_args

from pydantic import Field

from service.schemas.actor import Attributed
from service.schemas.base import Id, OpenChoice, Schema, is_empty
from service.schemas.geometry import PictureMotion, PosedCamera
from service.schemas.health import AlarmEvent
from service.schemas.history import PosesOrigin
from service.schemas.job import JobEvent
from service.schemas.names import EventKind

# The last event of a venue.
FINAL_EVENT = "venue.deleted"


class Poses(PosesOrigin):
    """Current poses and lenses of a venue's cameras: all that is needed to draw on their pictures."""

    venue: Id = Field(description="Id of the venue.")
    cameras: list[PosedCamera] = Field(description="Cameras with lenses and poses.")
    changed: list[Id] = Field(description="Cameras whose pose or lens differs from the previous revision.")
    picture_motions: dict[Id, PictureMotion] = Field(
        {},
        exclude_if=is_empty,
        description="By camera of `changed`, the motion of its picture since the previous revision, so that masks and "
        "zones can follow; without cameras that are new. Only with `poses.changed`.",
    )


class PosesEvent(Attributed):
    """New poses by a calibration, by hand or by PUT (`poses.changed`); first event of a stream (`poses.current`)."""

    type: Literal["poses.changed", "poses.current"] = Field(
        description="`poses.changed`; `poses.current`: the first event of a stream."
    )
    timestamp: datetime = Field(description="Time since which the poses are current.")
    data: Poses


class VenueChange(Schema):
    """A venue that was created, changed or deleted."""

    venue: Id = Field(description="Id of the venue.")
    changed: list[str] = Field(description="Fields of the venue that PUT or PATCH changed.")


class VenueEvent(Attributed):
    """Event of a venue that was created, changed or deleted."""

    type: Literal["venue.created", "venue.changed", "venue.deleted"] = Field(
        description="`venue.created`, `venue.changed` or `venue.deleted`, after which no event follows."
    )
    timestamp: datetime = Field(description="Time of the change.")
    data: VenueChange


Event = Annotated[
    PosesEvent | VenueEvent | JobEvent | AlarmEvent,
    Field(discriminator="type"),
    OpenChoice("type", "OtherEvent", "Event that later versions add: ignore it."),
]
EVENT_MODELS: tuple[type[Attributed], ...] = get_args(get_args(Event)[0])
# Clients skip other types, of newer versions.
EVENT_TYPES = frozenset(word for event in EVENT_MODELS for word in get_args(event.model_fields["type"].annotation))


def matches_kinds(event: str, kinds: Collection[EventKind]) -> bool:
    """True if an event type, such as `venue.changed`, is of one of the kinds, such as `venue.*`."""
    return event in kinds or f"{event.partition('.')[0]}.*" in kinds
