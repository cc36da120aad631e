"""The way of frames into the service: stored, then a job, or the job that they already are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import timedelta

from service.settings import Settings
from service.store.blobs import Blobs
from service.store.expiry import Expiry
from service.store.jobs.files import frame_folder
from service.store.jobs.submission import Enqueue, Refusal, Submission, Submissions
from service.wire.job import Job
from service.wire.problems import Problem

# Longer than any upload takes from its first stored frame to its job.
UPLOAD_GRACE = timedelta(hours=1)


class Intake:
    """Makes jobs of submissions."""

    def __init__(
        self, settings: Settings, submissions: Submissions, expiry: Expiry, blobs: Blobs, enqueue: Enqueue
    ) -> None:
        self._settings = settings
        self._submissions = submissions
        self._expiry = expiry
        self._blobs = blobs
        self._enqueue = enqueue

    def take(self, submission: Submission, store: Callable[[], None]) -> tuple[Job, bool]:
        """Store the files of a checked submission and make it a job, or find the job it already is; says if it is new.

        `store` puts them where the submission says. Raises a `Refusal`, and a `Problem` that `store` raises.
        """
        venue_id = None if submission.venue is None else submission.venue.id
        try:
            known = self._submissions.same_as(
                venue_id, submission.idempotency_key, submission.content_hash, submission.kind
            )
            if known is not None:
                return known, False
            # On the list of what is to be deleted before the first byte is stored, off it in the job's own transaction.
            self._expiry.expect_upload(submission.job_id, UPLOAD_GRACE)
            store()
            job, new = self._submissions.submit(submission, self._settings.queue_limit, self._enqueue)
        except (Refusal, Problem):
            self._blobs.delete_under(frame_folder(submission.job_id))
            raise
        if not new:
            self._blobs.delete_under(frame_folder(submission.job_id))
        # After any other error the frames stay: whether the transaction was committed is then not known.
        return job, new


def frame_paths(job_id: str, counts: Mapping[str, int]) -> dict[str, list[str]]:
    """Where the frames of a job will lie, by camera."""
    return {
        camera: [f"{frame_folder(job_id)}/{camera}/{number}" for number in range(count)]
        for camera, count in counts.items()
    }
