"""Venues of cameras that were found from their frames, which a person lets hold.

A job that looks for cameras stores nothing. What it found is taken by hand: the venue is created, or cameras of the one
that is there are put where they were found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from pydantic import ValidationError

from service.schemas.actor import Actor
from service.schemas.results import NO_CHOICE
from service.schemas.venue import Venue
from service.store.database import Repository, advisory_lock, reading, writing
from service.store.jobs.decisions import VenueHasChanged
from service.store.jobs.queries import FoundSite, found_site
from service.store.revisions import newest_revision
from service.store.venues import find_readable, find_stored, store_venue, venue_lock


class NothingFound(Exception):  # noqa: N818
    """The venue has no job of this id that has looked for its cameras and ended."""


class NoSuchCandidate(Exception):  # noqa: N818
    """A camera was not looked for (`count` None), or has only so many candidates."""

    def __init__(self, camera: str, count: int | None, sought: Sequence[str]) -> None:
        self.camera, self.count, self.sought = camera, count, sought


class CandidateNeeded(Exception):  # noqa: N818
    """Cameras of a new venue were not accepted, and nobody chose a candidate of them or leaves them out."""

    def __init__(self, cameras: Sequence[str]) -> None:
        self.cameras = cameras


class CandidateRefused(Exception):  # noqa: N818
    """No venue can have the chosen cameras; the message says why."""


class FoundVenueRepository(Repository):
    """The cameras that jobs in the database have found."""

    def is_adoptable(self, job_id: str) -> bool:
        """Whether `adopt` would find the venue as the job began with it, or not yet there."""
        with reading(self._engine) as connection:
            found = found_site(connection, job_id)
            if found is None:
                return False
            now_stored = find_readable(connection, found.site.id)
            if found.began_with is None or now_stored is None:
                return found.began_with is None and now_stored is None
            return _is_untouched(now_stored, found.began_with, found.site.sought)

    def adopt(
        self,
        venue_id: str,
        job_id: str,
        allow: Callable[[Venue | None], None],
        choice: Mapping[str, int | None] = NO_CHOICE,
        by: Actor | None = None,
    ) -> tuple[Venue, bool]:
        """Store the cameras that a job found as a new revision, or as a new venue; says if the venue is new.

        `choice`: see `FindResult.chosen`; `allow` may raise at the sight of the venue, None: it would be a new one.
        Raises `NothingFound`, `NoSuchCandidate`, `CandidateNeeded`, `CandidateRefused`, and `VenueHasChanged` where the
        field, or a camera that is taken, is not as the job began with it. Nothing is written if all stands so already.
        """
        with writing(self._engine) as connection:
            advisory_lock(connection, venue_lock(venue_id))
            found = found_site(connection, job_id)
            if found is None or found.site.id != venue_id:
                raise NothingFound
            _require_candidates(found, choice)
            stored = find_stored(connection, venue_id)
            before = None if stored is None else stored.venue
            if before is None and found.began_with is not None:
                raise VenueHasChanged(None)
            allow(before)
            wanted = _wanted(before, found, choice)
            if before is not None and wanted.has_same_calibration_input_as(before):
                return before, False
            taken = found.result.chosen(choice)
            if before is not None and (
                found.began_with is None or not _is_untouched(before, found.began_with, list(taken))
            ):
                raise VenueHasChanged(newest_revision(connection, venue_id))
            store_venue(connection, stored, wanted, "found", by, job_id)
            return wanted, before is None


def _require_candidates(found: FoundSite, choice: Mapping[str, int | None]) -> None:
    """Raise where the choice names what there is not, or leaves open what a new venue needs."""
    counts = {camera.id: len(camera.candidates) for camera in found.result.cameras}
    for camera, number in choice.items():
        if camera not in counts or (number is not None and number > counts[camera]):
            raise NoSuchCandidate(camera, counts.get(camera), list(counts))
    open_ones = [one.id for one in found.result.cameras if not one.accepted and one.id not in choice]
    if found.began_with is None and open_ones:
        raise CandidateNeeded(open_ones)


def _wanted(before: Venue | None, found: FoundSite, choice: Mapping[str, int | None]) -> Venue:
    """The new venue, or the one that is there with the chosen cameras where they were found."""
    try:
        placed = found.venue(choice)
    except ValidationError as error:
        raise CandidateRefused("; ".join(one["msg"].removeprefix("Value error, ") for one in error.errors())) from None
    if before is None or found.began_with is None:
        return placed
    taken = found.result.chosen(choice)
    cameras = {camera.id: camera for camera in placed.cameras if camera.id in taken}
    standing = [
        one.model_copy(update={"pose": cameras[one.id].pose, "intrinsics": cameras[one.id].intrinsics})
        if one.id in cameras
        else one
        for one in before.cameras
    ]
    # A ridge belongs to the poses of all cameras.
    is_each_taken = len(cameras) == len(before.cameras)
    return before.model_copy(update={"cameras": standing, "field": placed.field if is_each_taken else before.field})


def _is_untouched(now_stored: Venue, began_with: Venue, cameras: Sequence[str]) -> bool:
    """Whether the field and these cameras are as a job began with them, wherever the others have moved since."""
    stand, stood = ({one.id: one for one in venue.poses_and_lenses} for venue in (now_stored, began_with))
    return now_stored.field == began_with.field and all(
        camera in stand and stand[camera] == stood[camera] for camera in cameras
    )
