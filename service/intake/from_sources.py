"""Calibrations whose frames nobody sends: the service fetches them from the sources of the cameras."""

from __future__ import annotations

import hashlib
import io
import secrets

from service.intake.snapshots import Snapshots
from service.intake.submit import Enqueue, Intake, frame_paths
from service.store.ids import new_id
from service.store.jobs import Jobs, Origin, Submission
from service.store.venues import Venues
from service.wire.job import Job
from service.wire.options import Options
from service.wire.venue import Venue


class FromSources:
    """Fetches and submits."""

    def __init__(self, venues: Venues, jobs: Jobs, snapshots: Snapshots, intake: Intake) -> None:
        self._venues = venues
        self._jobs = jobs
        self._snapshots = snapshots
        self._intake = intake

    def calibrate(
        self, venue: Venue, options: Options, key: str | None, origin: Origin, enqueue: Enqueue
    ) -> tuple[Job, bool]:
        """A job from a frame of each source, or the job that the request already is; says if it is new.

        Raises a `Problem` for a source that gives no frame, and what `Intake.take` raises. The same request is the
        same job whatever the cameras show meanwhile.
        """
        sent = hashlib.sha256(f"sources {options.model_dump_json()}".encode()).hexdigest()
        known = self._jobs.same_as(venue.id, key, sent)
        if known is not None:
            return known, False
        frames = self._snapshots.take(venue.cameras, self._venues.credentials(venue.id))
        job_id = new_id()
        seeded = options if options.seed is not None else options.model_copy(update={"seed": secrets.randbelow(2**31)})
        paths = frame_paths(job_id, dict.fromkeys(frames, 1))
        submission = Submission(job_id, venue, seeded, sent, key, paths, origin=origin)
        return self._intake.take(submission, {camera: [io.BytesIO(data)] for camera, data in frames.items()}, enqueue)
