"""Calibrations whose frames nobody sends: the service fetches them from the sources of the cameras."""

from __future__ import annotations

from collections.abc import Sequence

from service.intake.snapshots import Snapshots
from service.intake.submit import Intake, frame_paths
from service.store.blobs import Blobs
from service.store.ids import new_id
from service.store.jobs.submission import Submission, Submissions, VenueGone, fetched_hash
from service.store.jobs.task import Origin, seeded
from service.store.venues import Venues
from service.wire.job import Job, JobError
from service.wire.options import Options
from service.wire.problems import KINDS, Problem, type_of
from service.wire.venue import Venue


class FromSources:
    """Fetches and submits."""

    def __init__(
        self, venues: Venues, submissions: Submissions, snapshots: Snapshots, blobs: Blobs, intake: Intake
    ) -> None:
        self._venues = venues
        self._submissions = submissions
        self._snapshots = snapshots
        self._blobs = blobs
        self._intake = intake

    def calibrate(self, venue_id: str, options: Options, key: str | None, origin: Origin) -> tuple[Job, bool]:
        """A job from a frame of each source, or the job that the request already is; says if it is new.

        Raises a `Problem` for a source that gives no frame, `VenueGone` and what else `Intake.take` raises. The same
        request is the same job whatever the cameras show meanwhile.
        """
        sent = fetched_hash(options)
        known = self._submissions.same_as(venue_id, key, sent)
        if known is not None:
            return known, False
        found = self._venues.with_credentials(venue_id)
        if found is None:
            raise VenueGone
        venue, credentials = found
        frames = self._snapshots.take(venue.cameras, credentials)
        submission = _submission(venue, options, key, origin, list(frames))

        def store() -> None:
            for camera, (path,) in submission.frames.items():
                self._blobs.put(path, frames[camera])

        return self._intake.take(submission, store)

    def fail(self, venue: Venue, options: Options, key: str | None, origin: Origin, why: Problem) -> Job:
        """A job for a calibration that nobody waits for and whose frames could not be had: it has failed."""
        error = JobError(
            type=type_of(why.kind), title=KINDS[why.kind].title, detail=why.detail, camera=why.parts.get("camera")
        )
        return self._submissions.fail(_submission(venue, options, key, origin, []), error)


def _submission(venue: Venue, options: Options, key: str | None, origin: Origin, cameras: Sequence[str]) -> Submission:
    job_id = new_id()
    return Submission(
        job_id=job_id,
        venue=venue,
        options=seeded(options),
        frames=frame_paths(job_id, dict.fromkeys(cameras, 1)),
        origin=origin,
        content_hash=fetched_hash(options),
        idempotency_key=key,
    )
