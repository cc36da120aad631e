"""Calibrations whose frames the service fetches from the sources of the cameras."""

import hashlib
from collections.abc import Callable, Mapping, Sequence

from service.intake.snapshots import Snapshots
from service.intake.submit import Intake, frame_paths
from service.schemas.job import Job, JobError
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store.blobs import Blobs
from service.store.ids import new_id
from service.store.jobs.submission import Submission, fetched_hash
from service.store.jobs.task import Origin, seeded
from service.store.repositories import Repositories


class FromSources:
    """Fetches and submits."""

    def __init__(self, store: Repositories, snapshots: Snapshots, blobs: Blobs, intake: Intake) -> None:
        self._venues, self._submissions = store.venues, store.submissions
        self._snapshots, self._blobs, self._intake = snapshots, blobs, intake

    def calibrate(
        self,
        venue_id: str,
        options: Options,
        key: str | None,
        origin: Origin,
        frames: int = 1,
        spacing_s: float = 0.0,
        within_s: float | None = None,
        fetched: Callable[[], None] = lambda: None,
    ) -> tuple[Job, bool]:
        """Fetch frames of each source and submit them; return the job that they are, and True if it is new.

        `within_s`: the time that the sources have, at most that of the settings. `fetched` is called once all frames
        have come. Raises a `Problem` for a source that gives no frame, and those of `Intake.take`. The same request is
        the same job whatever the cameras show meanwhile.
        """
        sent = fetched_hash(options)
        known = self._submissions.same_as(venue_id, key, sent)
        if known is not None:
            return known, False
        self._intake.require_place(origin)
        venue, credentials = self._venues.with_credentials(venue_id)
        taken = self._snapshots.take_of_all(venue.cameras, credentials, frames, spacing_s, within_s)
        fetched()
        hashes = {camera: [hashlib.sha256(frame).hexdigest() for frame in several] for camera, several in taken.items()}
        submission = _submission(venue, options, key, origin, hashes)

        def store() -> None:
            for camera, paths in submission.frames.items():
                for path, frame in zip(paths, taken[camera], strict=True):
                    self._blobs.put(path, frame)

        return self._intake.take(submission, store)

    def fail(self, venue: Venue, options: Options, key: str | None, origin: Origin, why: Problem) -> Job:
        """Record a failed job for a scheduled calibration whose frames could not be fetched."""
        error = JobError.of(why.kind, why.detail, why.parts.get("camera"))
        return self._submissions.fail(_submission(venue, options, key, origin, {}), error)


def _submission(
    venue: Venue, options: Options, key: str | None, origin: Origin, hashes: Mapping[str, Sequence[str]]
) -> Submission:
    job_id = new_id()
    return Submission(
        job_id=job_id,
        venue=venue,
        options=seeded(options),
        frames=frame_paths(job_id, hashes),
        origin=origin,
        content_hash=fetched_hash(options),
        idempotency_key=key,
    )
