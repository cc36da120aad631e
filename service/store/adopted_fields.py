"""Numbers of the field as the lines of a calibration have them, which a person lets hold: all SQL about them.

They belong to a job as long as the venue stands as the job left it: once a camera was put elsewhere, or another
calibration was accepted, the newer job says what its lines say.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from pydantic import ValidationError

from service.schemas.actor import Actor
from service.schemas.field import FieldOfPlay, LengthRefused
from service.schemas.names import FieldNumber
from service.schemas.results import AdoptableNumber, Result
from service.schemas.venue import Venue
from service.store.alarms import update_alarms
from service.store.database import Repository, reading
from service.store.events.event_log import add_venue_event
from service.store.jobs.decisions import VenueHasChanged
from service.store.jobs.queries import found_poses
from service.store.memories import forget_memories
from service.store.refined import is_of
from service.store.revisions import (
    FIELD_NUMBERS,
    RevisionUnfit,
    add_revision,
    newest_revision,
    revision_of_job,
    state_at,
)
from service.store.statistics.venue_quality import update_quality
from service.store.trends import forget_trends
from service.store.venues import StoredVenue, changing_venue, find_readable, save_venue, with_result


class NoSuchJob(Exception):  # noqa: N818
    """The venue has no calibration of this id that found something."""


class NotAdoptable(Exception):  # noqa: N818
    """The job does not offer the number; `offered` has those that it does."""

    def __init__(self, offered: Sequence[str]) -> None:
        self.offered = offered


class NumberRefused(Exception):  # noqa: N818
    """The sport has no field with that number; the message says why."""


@dataclass(frozen=True)
class Adoptable:
    """A number that can be stored now, or why it is refused."""

    number: AdoptableNumber
    refused_because: str | None


class AdoptedFieldRepository(Repository):
    """The numbers of fields that the results of jobs in the database offer."""

    def adoptable(self, job_id: str) -> dict[str, Adoptable]:
        """Return the numbers that a job offers now, by name, and in words why `adopt` would refuse one."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
            venue = None if found is None else find_readable(connection, found[0].id)
            if found is None or venue is None or not found[1].adoptable:
                return {}
            left = _left_by(connection, job_id, *found)
            if not _holds(connection, venue, left):
                return {}
        to_come = [one for one in left.offered if one not in left.adopted(venue.field)]
        return {one.name: Adoptable(one, _refusal(left, venue.field, one)) for one in to_come}

    def adopt(
        self,
        venue_id: str,
        job_id: str,
        name: FieldNumber,
        allow: Callable[[Venue | None], None],
        by: Actor | None = None,
    ) -> Venue:
        """Store a number of the field as a job offers it, as a new revision, unless `allow` raises at the sight.

        The memories and trends of the cameras end, as with any other field that is put. Poses stay: the next
        calibration moves them. Raises `NoSuchJob`, `NotAdoptable`, `VenueHasChanged` and `NumberRefused`. Nothing is
        written if the field has that number already.
        """
        with changing_venue(self._engine, venue_id, allow) as (connection, stored):
            before = stored.venue
            found = found_poses(connection, job_id)
            if found is None or found[0].id != venue_id:
                raise NoSuchJob
            left = _left_by(connection, job_id, *found)
            wanted = next((one for one in left.offered if one.name == name), None)
            if wanted is None:
                raise NotAdoptable([one.name for one in left.offered])
            if not _holds(connection, before, left):
                raise VenueHasChanged(newest_revision(connection, venue_id))
            try:
                venue = before.model_copy(update={"field": left.field_with(before.field, wanted)})
            except ValidationError as error:
                raise NumberRefused(_in_words(error)) from None
            if venue.field != before.field:
                _save(connection, stored, venue, job_id, by)
            return venue


@dataclass(frozen=True)
class _Left:
    """What a job left: the `revision` that its poses became, None if they never held; the `result` and its `field`."""

    revision: int | None
    result: Result
    field: FieldOfPlay

    @property
    def offered(self) -> list[AdoptableNumber]:
        """The numbers that the result offers, of those that this version knows."""
        return [one for one in self.result.adoptable if one.name in FIELD_NUMBERS]

    def adopted(self, field: FieldOfPlay) -> list[AdoptableNumber]:
        """Return which of the offered numbers a field has already."""
        return [one for one in self.offered if field.number(one.name) == one.value]

    def field_with(self, field: FieldOfPlay, *wanted: AdoptableNumber) -> FieldOfPlay:
        """The field that the job left with the numbers of it that `field` has, and others that are wanted.

        In whatever order they are adopted, the ridge is the one that the lines were asked for: it comes first, and
        keeps its ends. Raises `ValidationError` where the sport has no such field.
        """
        numbers = {one.name: one.value for one in (*self.adopted(field), *wanted)}
        changed = self.field
        for name in FIELD_NUMBERS:
            if name in numbers:
                changed = changed.with_number(name, numbers[name])
        return changed


def _left_by(connection: sa.Connection, job_id: str, began_with: Venue, result: Result) -> _Left:
    """What a job left of the venue that it began with."""
    return _Left(revision_of_job(connection, job_id), result, with_result(began_with, result).field)


def _holds(connection: sa.Connection, venue: Venue, left: _Left) -> bool:
    """Whether the poses that a job brought hold, on the field that they were found on.

    A camera may have its refined pose and lens instead, and the field other numbers that the job offers.
    """
    if left.revision is None:
        return False
    try:
        then, _ = state_at(connection, venue, left.revision)
        field = left.field_with(venue.field)
    except (RevisionUnfit, ValidationError):
        return False
    refined = {camera.id: camera.refined for camera in left.result.cameras}
    stood = {camera.id: camera for camera in then.cameras}
    return field == venue.field and all(
        is_of(camera, stood[camera.id], refined.get(camera.id)) for camera in venue.cameras
    )


def _refusal(left: _Left, field: FieldOfPlay, wanted: AdoptableNumber) -> str | None:
    """Why a field cannot have a number; None: it can."""
    try:
        left.field_with(field, wanted)
    except ValidationError as error:
        return _in_words(error)
    return None


def _in_words(error: ValidationError) -> str:
    return "; ".join(map(_reason, error.errors()))


def _reason(finding: Mapping[str, Any]) -> str:
    """Return what is wrong with a number of the lines, which is in metres: its unit is not in question."""
    cause = finding.get("ctx", {}).get("error")
    return cause.limits if isinstance(cause, LengthRefused) else finding["msg"].removeprefix("Value error, ")


def _save(connection: sa.Connection, before: StoredVenue, venue: Venue, job_id: str, by: Actor | None) -> None:
    """Store the venue with its other field, inside the caller's serialised transaction."""
    forget_memories(connection, venue.id)
    forget_trends(connection, venue.id)
    with update_quality(connection, venue.id) as quality:
        save_venue(connection, venue, quality.now, before)
        add_venue_event(connection, venue, "venue.changed", ["field"], by)
        add_revision(connection, quality, venue, "adopted", job_id, by=by, field_before=before.venue.field)
        update_alarms(connection, quality, venue)
