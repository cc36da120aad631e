"""What happens to a venue, as those hear of it who follow it."""

from __future__ import annotations

from collections.abc import Collection
from datetime import datetime
from typing import Annotated, Literal, get_args

from pydantic import Field

from service.schemas.actor import Attributed
from service.schemas.base import OPEN_WORD, Id, Schema
from service.schemas.geometry import PosedCamera, Row
from service.schemas.health import AlarmEvent
from service.schemas.history import Cause
from service.schemas.job import JobEvent
from service.schemas.names import EventKind

# Nothing comes after it.
FINAL_EVENT = "venue.deleted"


class Poses(Schema):
    """The cameras of a venue as they stand: what draws on their pictures needs nothing else."""

    venue: Id
    revision: int = Field(description="In the history of the venue. It grows: of two, the higher one holds.")
    cause: Annotated[Cause, OPEN_WORD]
    job: str | None = Field(description="Whose poses these are; of a restored revision, whose were rejected by hand.")
    stitch_error_px: float | None
    ridge: list[Row] | None
    cameras: list[PosedCamera]
    changed: list[Id] = Field(description="The cameras that stand or image otherwise than by the revision before.")


class PosesEvent(Attributed):
    """`poses.changed`: by a calibration, by hand or by PUT. `poses.current`: how a stream of events begins."""

    type: Literal["poses.changed", "poses.current"]
    timestamp: datetime = Field(description="Since when they hold.")
    data: Poses


class VenueChange(Schema):
    """A venue that was put, changed or deleted."""

    venue: Id
    changed: list[str] = Field(description="The parts of it that PUT or PATCH changed.")


class VenueEvent(Attributed):
    """Somebody put a venue, changed or deleted it."""

    type: Literal["venue.created", "venue.changed", "venue.deleted"]
    timestamp: datetime
    data: VenueChange


Event = Annotated[PosesEvent | VenueEvent | JobEvent | AlarmEvent, Field(discriminator="type")]
EVENT_MODELS: tuple[type[Attributed], ...] = get_args(get_args(Event)[0])
# Those of a newer version are passed over.
EVENT_TYPES = frozenset(word for event in EVENT_MODELS for word in get_args(event.model_fields["type"].annotation))


def matches_kinds(event: str, kinds: Collection[EventKind]) -> bool:
    """Whether an event of this type is of one of the kinds."""
    return event in kinds or f"{event.partition('.')[0]}.*" in kinds
