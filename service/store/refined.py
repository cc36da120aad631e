"""Refined poses and lenses, which calibrations find beside those that they answer: all SQL about them.

A refined pose belongs to a venue as long as the venue stands as the job left it: once a camera was put elsewhere, or
the field is another one, it is about something else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.results import Refined
from service.schemas.venue import Camera, Venue
from service.store import tables
from service.store.alarms import update_alarms
from service.store.database import Repository, reading
from service.store.jobs.queries import found_poses
from service.store.memories import keep_memories, newest_memories
from service.store.revisions import CALIBRATION_CAUSES, add_revision
from service.store.statistics.venue_quality import update_quality
from service.store.venues import changing_venue, save_venue, with_result

# Revisions in which the last accepted pose of a camera is looked for: others may have been accepted without it since.
LOOKED_BACK = 20
r = tables.revisions.c


class NoRefinedPose(Exception):  # noqa: N818
    """A camera has no refined pose that belongs to its stored one."""


@dataclass(frozen=True)
class FoundRefined:
    """A refined pose and lens, and the job that found them."""

    job: str
    refined: Refined


class RefinedPoseRepository(Repository):
    """The refined poses in the results of the jobs in the database."""

    def of_venue(self, venue: Venue) -> dict[str, Refined]:
        """Those of the last accepted calibrations, by the cameras that still stand as these left them."""
        with reading(self._engine) as connection:
            return {camera: found.refined for camera, found in _refined_of(connection, venue).items()}

    def of_job(self, job_id: str) -> dict[str, Refined]:
        """Those that a calibration found, accepted or not, by camera."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
        cameras = [] if found is None else found[1].cameras
        return {camera.id: camera.refined for camera in cameras if camera.refined is not None}

    def adopt(
        self, venue_id: str, camera_id: str, allow: Callable[[Venue | None], None], by: Actor | None = None
    ) -> Venue:
        """Store a camera's refined pose and lens as a new revision, unless `allow` raises at the sight of the venue.

        The memories stay: they hold measurements, which are the same whatever the lens is taken to be. Raises
        `NoRefinedPose`. Nothing is written if the camera has that pose and lens already.
        """
        with changing_venue(self._engine, venue_id, allow) as (connection, stored):
            before = stored.venue
            found = _refined_of(connection, before).get(camera_id)
            if found is None:
                raise NoRefinedPose
            venue = with_refined(before, {camera_id: found.refined}, keep_sigma=True)
            if not venue.has_same_poses_as(before):
                with update_quality(connection, venue_id) as quality:
                    save_venue(connection, venue, quality.now, stored)
                    number = add_revision(connection, quality, venue, "adopted", found.job, by=by)
                    keep_memories(connection, venue_id, number, newest_memories(connection, venue_id))
                    update_alarms(connection, quality, venue)
            return venue


def with_refined(venue: Venue, refined: dict[str, Refined], *, keep_sigma: bool = False) -> Venue:
    """A venue with the refined poses and lenses of some of its cameras.

    `keep_sigma`: their lenses are said to be known as well as before. A lens that is stored must not bring the
    certainty that the lines gave it: the next job asks the same lines again, from the camera's memory.
    """
    cameras = [
        _refined_camera(camera, refined[camera.id], keep_sigma=keep_sigma) if camera.id in refined else camera
        for camera in venue.cameras
    ]
    return venue.model_copy(update={"cameras": cameras})


def _refined_camera(camera: Camera, refined: Refined, *, keep_sigma: bool) -> Camera:
    lens = refined.intrinsics
    if keep_sigma:
        lens = lens.model_copy(update={"sigma": camera.intrinsics.sigma})
    return camera.model_copy(update={"pose": refined.pose, "intrinsics": lens})


def _refined_of(connection: sa.Connection, venue: Venue) -> dict[str, FoundRefined]:
    """By camera, what the calibration found beside the pose that the camera has now."""
    found: dict[str, FoundRefined] = {}
    sought = {camera.id: camera for camera in venue.cameras}
    for job_id in _jobs_that_brought_poses(connection, venue.id):
        if not sought:
            break
        calibrated = found_poses(connection, job_id)
        if calibrated is None:
            continue
        left_by_it = with_result(*calibrated)
        if left_by_it.field != venue.field:
            break
        answered = {camera.id: camera for camera in left_by_it.cameras}
        for result in calibrated[1].cameras:
            camera = sought.get(result.id)
            if camera is None or not result.accepted or not is_of(camera, answered[result.id], result.refined):
                continue
            del sought[result.id]
            if result.refined is not None:
                found[result.id] = FoundRefined(job_id, result.refined)
    return found


def is_of(camera: Camera, answered: Camera, refined: Refined | None) -> bool:
    """Whether a camera stands where a calibration answered that it stands, or has its refined pose already."""
    ways = [answered.posed.pose_and_lens]
    if refined is not None:
        ways.append(_refined_camera(answered, refined, keep_sigma=True).posed.pose_and_lens)
    return camera.posed.pose_and_lens in ways


def _jobs_that_brought_poses(connection: sa.Connection, venue_id: str) -> list[str]:
    """Jobs of the last revisions that calibrations brought, newest first, each once."""
    query = sa.select(r.job).where(r.venue == venue_id, r.cause.in_(CALIBRATION_CAUSES)).order_by(r.number.desc())
    return list(dict.fromkeys(connection.scalars(query.limit(LOOKED_BACK))))
