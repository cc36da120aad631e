"""Adoption of what jobs offer beside the poses that they store: all SQL about it.

Calibrations offer refined poses and lenses, and numbers of the field; searches offer the cameras that they found. A
person stores one of these as a new revision. Calibrations offer theirs as long as the venue stands as they left it,
searches as long as it stands as they began with it. Otherwise the offer is about other poses, or another field.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sqlalchemy as sa
from pydantic import ValidationError

from service.schemas.actor import Actor
from service.schemas.field import FieldOfPlay, LengthRefused
from service.schemas.names import FieldNumber
from service.schemas.problems import Problem
from service.schemas.results import NO_CHOICE, AdoptableNumber, Refined, Result
from service.schemas.venue import Camera, Venue
from service.store import tables
from service.store.alarms import with_alarms
from service.store.database import Repository, lock_venue, reading, writing
from service.store.jobs.queries import FoundSite, found_poses, found_site
from service.store.memories import newest_memories
from service.store.preconditions import UNCONDITIONAL, Precondition
from service.store.refusals import camera_of, no_refined_pose, no_refined_since, venue_moved_on
from service.store.revisions import CALIBRATION_CAUSES, FIELD_NUMBERS, newest_revision, revision_of_job, state_at
from service.store.venue_fold import with_result, with_revision, with_venue
from service.store.venue_state import load, write_changes
from service.store.venues import changing_venue, find_readable, find_stored, store_venue

# Newest revisions in which the accepted pose of a camera is looked for: others may have been accepted without it since.
SEARCHED_REVISIONS = 20
r = tables.revisions.c


@dataclass(frozen=True)
class Adoptable:
    """Number of the field that a job offers, and why it cannot be stored, None if it can."""

    number: AdoptableNumber
    refused_because: str | None


class AdoptionRepository(Repository):
    """Offers of the jobs in the database."""

    def refined_of_venue(self, venue: Venue) -> dict[str, Refined]:
        """Return by camera the refined poses of the last accepted calibrations whose poses the cameras still have."""
        with reading(self._engine) as connection:
            return {camera: refined for camera, (_, refined) in _refined_of(connection, venue).items()}

    def refined_of_job(self, job_id: str) -> dict[str, Refined]:
        """Return by camera the refined poses that a calibration found, accepted or not."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
        cameras = [] if found is None else found[1].cameras
        return {camera.id: camera.refined for camera in cameras if camera.refined is not None}

    def adopt_refined(
        self, venue_id: str, camera_id: str, precondition: Precondition = UNCONDITIONAL, by: Actor | None = None
    ) -> Venue:
        """Store the refined pose and lens of a camera as a new revision, unless the camera has them already.

        The memories stay: they hold measurements, which are the same whatever the lens is taken to be. Raises the
        problem `refined-not-found`.
        """
        with changing_venue(self._engine, venue_id, precondition) as (connection, stored):
            before = stored.venue
            camera = camera_of(before, camera_id)
            job_id, refined = _refined_of(connection, before).get(camera_id, (None, None))
            if refined is None:
                raise no_refined_pose(camera_id, no_refined_since(venue_id))
            # A lens that is stored must not bring the certainty that the lines gave it: the next job asks the same
            # lines again, from the camera's memory.
            lens = refined.intrinsics.model_copy(update={"sigma": camera.intrinsics.sigma})
            venue = before.with_cameras({camera_id: {"pose": refined.pose, "intrinsics": lens}})
            if not venue.has_same_poses_as(before):
                memories = newest_memories(connection, venue_id)
                changes = with_venue(load(connection, venue_id), stored, venue)
                changes = with_revision(changes, venue, "adopted", memories, job_id, by)
                write_changes(connection, with_alarms(changes, venue))
            return venue

    def adoptable_numbers(self, job_id: str) -> dict[str, Adoptable]:
        """Return by name the numbers of the field that a job offers now, and why `adopt_number` would refuse one."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
            venue = None if found is None else find_readable(connection, found[0].id)
            if found is None or venue is None or not found[1].adoptable:
                return {}
            calibrated = _calibrated_by(connection, job_id, *found)
            if not _is_in_use(connection, venue, calibrated):
                return {}
        adopted = calibrated.adopted(venue.field)
        return {
            number.name: Adoptable(number, _refusal(calibrated, venue.field, number))
            for number in calibrated.offered
            if number not in adopted
        }

    def adopt_number(
        self,
        venue_id: str,
        job_id: str,
        name: FieldNumber,
        precondition: Precondition = UNCONDITIONAL,
        by: Actor | None = None,
    ) -> Venue:
        """Store a number of the field that a job offers as a new revision, unless the field has that number already.

        The memories and trends of the cameras end, as with any other field that is put. Poses stay: the next
        calibration moves them. Raises the problems `job-not-found`, `field-number-not-found`, `venue-moved-on` and
        `field-number-refused`.
        """
        with changing_venue(self._engine, venue_id, precondition) as (connection, stored):
            before = stored.venue
            found = found_poses(connection, job_id)
            if found is None or found[0].id != venue_id:
                raise Problem("job-not-found", f"GET /jobs?venue={venue_id} lists the calibrations of the venue.")
            calibrated = _calibrated_by(connection, job_id, *found)
            names = [number.name for number in calibrated.offered]
            if name not in names:
                offers = f"It offers {', '.join(names)}." if names else "It offers none."
                raise Problem("field-number-not-found", offers, job=job_id, expected=names, got=name)
            if not _is_in_use(connection, before, calibrated):
                raise venue_moved_on(venue_id, job_id, newest_revision(connection, venue_id))
            try:
                field = calibrated.field_with(before.field, calibrated.offered[names.index(name)])
            except ValidationError as error:
                why = f"{_in_words(error)}. Measure the field again."
                raise Problem("field-number-refused", why, job=job_id, got=name) from None
            venue = before.model_copy(update={"field": field})
            if field != before.field:
                store_venue(connection, stored, venue, "adopted", by, job_id)
            return venue

    def can_adopt_found(self, job_id: str) -> bool:
        """Return True if the venue of a search stands as the search began with it, or is still not stored."""
        with reading(self._engine) as connection:
            found = found_site(connection, job_id)
            if found is None:
                return False
            venue = find_readable(connection, found.site.id)
            if found.began_with is None or venue is None:
                return found.began_with is None and venue is None
            return _is_untouched(venue, found.began_with, found.site.sought)

    def adopt_found(
        self,
        venue_id: str,
        job_id: str,
        choice: Mapping[str, int | None] = NO_CHOICE,
        precondition: Precondition = UNCONDITIONAL,
        by: Actor | None = None,
        no_new_venue: Problem | None = None,
    ) -> tuple[Venue, bool]:
        """Store the cameras that a search found as a new revision or a new venue; return it, and True if it is new.

        `choice`: see `FindResult.chosen`. `no_new_venue`: the problem to raise where the venue would be new. Raises the
        problems `poses-not-found`, `candidate-not-found`, `candidate-needed`, `candidate-refused`, and `venue-moved-on`
        if the field or a chosen camera is not as the search began with it. Nothing is written if all stands so already.
        """
        with writing(self._engine) as connection:
            lock_venue(connection, venue_id)
            found = found_site(connection, job_id)
            if found is None or found.site.id != venue_id:
                why = f"Venue {venue_id} has no job of this id that looked for its cameras and ended."
                raise Problem("poses-not-found", why, job=job_id)
            _require_candidates(found, choice, job_id)
            stored = find_stored(connection, venue_id)
            if stored is None and found.began_with is not None:
                raise venue_moved_on(venue_id, job_id, None)
            before = None if stored is None else stored.venue
            precondition.check(before)
            if before is None and no_new_venue is not None:
                raise no_new_venue
            venue = _with_found(before, found, choice, job_id)
            if before is not None:
                if venue.has_same_calibration_input_as(before):
                    return before, False
                chosen = list(found.result.chosen(choice))
                if found.began_with is None or not _is_untouched(before, found.began_with, chosen):
                    raise venue_moved_on(venue_id, job_id, newest_revision(connection, venue_id))
            store_venue(connection, stored, venue, "found", by, job_id)
            return venue, before is None


# Refined poses


def _refined_of(connection: sa.Connection, venue: Venue) -> dict[str, tuple[str, Refined]]:
    """Return by camera the calibration that brought its pose, and the refined pose that it found."""
    refined: dict[str, tuple[str, Refined]] = {}
    sought = {camera.id: camera for camera in venue.cameras}
    query = sa.select(r.job).where(r.venue == venue.id, r.cause.in_(CALIBRATION_CAUSES)).order_by(r.number.desc())
    for job_id in dict.fromkeys(connection.scalars(query.limit(SEARCHED_REVISIONS))):
        if not sought:
            break
        found = found_poses(connection, job_id)
        if found is None:
            continue
        calibrated = with_result(*found)
        if calibrated.field != venue.field:
            break
        cameras = {camera.id: camera for camera in calibrated.cameras}
        for result in found[1].cameras:
            camera = sought.get(result.id)
            if camera is None or not result.accepted or not _has_pose_of(camera, cameras[result.id], result.refined):
                continue
            del sought[result.id]
            if result.refined is not None:
                refined[result.id] = job_id, result.refined
    return refined


def _has_pose_of(camera: Camera, calibrated: Camera, refined: Refined | None) -> bool:
    """Return True if a camera has the pose and lens that a calibration found, or the refined ones."""
    poses = [calibrated.posed.pose_and_lens]
    if refined is not None:
        found = calibrated.model_copy(update={"pose": refined.pose, "intrinsics": refined.intrinsics})
        poses.append(found.posed.pose_and_lens)
    return camera.posed.pose_and_lens in poses


# Numbers of the field


@dataclass(frozen=True)
class _Calibrated:
    """A calibration: the `revision` that its poses became, None if they never did; its `result` and its `field`."""

    revision: int | None
    result: Result
    field: FieldOfPlay

    @property
    def offered(self) -> list[AdoptableNumber]:
        """Numbers that the result offers and this version knows."""
        return [number for number in self.result.adoptable if number.name in FIELD_NUMBERS]

    def adopted(self, field: FieldOfPlay) -> list[AdoptableNumber]:
        """Return the offered numbers that a field has already."""
        return [number for number in self.offered if field.number(number.name) == number.value]

    def field_with(self, field: FieldOfPlay, *added: AdoptableNumber) -> FieldOfPlay:
        """Return the field of the calibration with the offered numbers that `field` has, and with those `added`.

        In whatever order they are adopted, the ridge is the one that the lines were asked for: it comes first, and
        keeps its ends. Raises `ValidationError` where the sport has no such field.
        """
        numbers = {number.name: number.value for number in (*self.adopted(field), *added)}
        changed = self.field
        for name in FIELD_NUMBERS:
            if name in numbers:
                changed = changed.with_number(name, numbers[name])
        return changed


def _calibrated_by(connection: sa.Connection, job_id: str, began_with: Venue, result: Result) -> _Calibrated:
    return _Calibrated(revision_of_job(connection, job_id), result, with_result(began_with, result).field)


def _is_in_use(connection: sa.Connection, venue: Venue, calibrated: _Calibrated) -> bool:
    """Return True if a venue has the poses that a calibration brought, on the field that they were found on.

    A camera may have its refined pose and lens instead, and the field other numbers that the job offers.
    """
    if calibrated.revision is None:
        return False
    try:
        then, _ = state_at(connection, venue, calibrated.revision)
        field = calibrated.field_with(venue.field)
    except (Problem, ValidationError):
        return False
    refined = {camera.id: camera.refined for camera in calibrated.result.cameras}
    cameras = {camera.id: camera for camera in then.cameras}
    return field == venue.field and all(
        _has_pose_of(camera, cameras[camera.id], refined.get(camera.id)) for camera in venue.cameras
    )


def _refusal(calibrated: _Calibrated, field: FieldOfPlay, number: AdoptableNumber) -> str | None:
    """Return why a field cannot have a number, None if it can."""
    try:
        calibrated.field_with(field, number)
    except ValidationError as error:
        return _in_words(error)
    return None


def _in_words(error: ValidationError) -> str:
    """Return what is wrong with what the lines gave, which is in metres: its unit is not in question."""
    causes = [(finding.get("ctx", {}).get("error"), finding["msg"]) for finding in error.errors()]
    return "; ".join(
        cause.limits if isinstance(cause, LengthRefused) else message.removeprefix("Value error, ")
        for cause, message in causes
    )


# Cameras that were found


def _require_candidates(found: FoundSite, choice: Mapping[str, int | None], job_id: str) -> None:
    """Raise a problem if the choice names a missing camera or candidate, or leaves out a camera of a new venue."""
    counts = {camera.id: len(camera.candidates) for camera in found.result.cameras}
    for camera, number in choice.items():
        if camera not in counts:
            why = f"The job looked for {', '.join(counts)}."
            raise Problem("candidate-not-found", why, job=job_id, camera=camera, expected=list(counts))
        if number is not None and number > counts[camera]:
            why = f"Camera {camera} has {counts[camera]} candidates."
            raise Problem("candidate-not-found", why, job=job_id, camera=camera, expected=counts[camera])
    undecided = [camera.id for camera in found.result.cameras if not camera.accepted and camera.id not in choice]
    if found.began_with is None and undecided:
        why = f"Choose one of the candidates of {', '.join(undecided)}, or null to leave it out."
        raise Problem("candidate-needed", why, job=job_id, expected=undecided)


def _with_found(before: Venue | None, found: FoundSite, choice: Mapping[str, int | None], job_id: str) -> Venue:
    """Return the new venue, or the stored one with the chosen cameras where they were found."""
    try:
        placed = found.venue(choice)
    except ValidationError as error:
        raise Problem("candidate-refused", f"{_in_words(error)}.", job=job_id) from None
    if before is None or found.began_with is None:
        return placed
    chosen = found.result.chosen(choice)
    moved = {
        camera.id: {"pose": camera.pose, "intrinsics": camera.intrinsics}
        for camera in placed.cameras
        if camera.id in chosen
    }
    # A ridge belongs to the poses of all cameras.
    field = placed.field if len(moved) == len(before.cameras) else before.field
    return before.with_cameras(moved, field=field)


def _is_untouched(venue: Venue, began_with: Venue, cameras: Sequence[str]) -> bool:
    """Return True if the field and these cameras are as a job began with them, wherever the others have moved since."""
    now, then = ({camera.id: camera for camera in each.poses_and_lenses} for each in (venue, began_with))
    return venue.field == began_with.field and all(camera in now and now[camera] == then[camera] for camera in cameras)
