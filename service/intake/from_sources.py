"""Calibrations whose frames nobody sends: the service fetches them from the sources of the cameras."""

from __future__ import annotations

from service.intake.snapshots import Snapshots
from service.intake.submit import Intake, frame_paths
from service.store.blobs import Blobs
from service.store.ids import new_id
from service.store.jobs.submission import Submission, Submissions, VenueGone, fetched_hash
from service.store.jobs.task import Origin, seeded
from service.store.venues import Venues
from service.wire.job import Job
from service.wire.options import Options


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
        job_id = new_id()
        submission = Submission(
            job_id=job_id,
            venue=venue,
            options=seeded(options),
            frames=frame_paths(job_id, dict.fromkeys(frames, 1)),
            origin=origin,
            content_hash=sent,
            idempotency_key=key,
        )

        def store() -> None:
            for camera, (path,) in submission.frames.items():
                self._blobs.put(path, frames[camera])

        return self._intake.take(submission, store)
