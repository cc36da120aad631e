"""Intake of submissions: their frames are stored, and become a job unless they are one already."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import timedelta

from service.schemas.job import Job
from service.schemas.problems import Problem
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.database import DATABASE_OUTAGES
from service.store.jobs.attempts import Enqueue
from service.store.jobs.files import frame_folder, frame_path
from service.store.jobs.submission import Submission
from service.store.jobs.task import Origin
from service.store.repositories import Repositories

# Longer than any upload takes from its first stored frame to its job.
UPLOAD_GRACE = timedelta(hours=1)


class Intake:
    """Makes jobs of submissions."""

    def __init__(self, settings: Settings, store: Repositories, blobs: Blobs, enqueue: Enqueue) -> None:
        self._settings = settings
        self._submissions, self._expiry = store.submissions, store.expiry
        self._blobs, self._enqueue = blobs, enqueue

    def take(self, submission: Submission, store: Callable[[], None]) -> tuple[Job, bool]:
        """Store the files of a checked submission and make it a job, or find the job it already is; says if it is new.

        `store` puts them where the submission says. Raises a `Problem` where the submission is refused.
        """
        # Storing costs more than asking: the place in the queue too, which the transaction of the job asks for again.
        known = self._submissions.announce(submission, self._settings.queue_limit, UPLOAD_GRACE)
        if known is not None:
            return known, False
        try:
            store()
            job, new = self._submissions.submit(submission, self._settings.queue_limit, self._enqueue)
        except Problem:
            self._take_back(submission.job_id)
            raise
        if not new:
            self._take_back(submission.job_id)
        # After any other error the frames stay: whether the transaction was committed is then not known.
        return job, new

    def require_place(self, origin: Origin) -> None:
        """Raise the problem `queue-full` if no place is free, or those that are free are kept for schedules."""
        self._submissions.require_place(self._settings.queue_limit, is_schedule=origin.is_schedule)

    def _take_back(self, job_id: str) -> None:
        """Delete the frames of a submission that became no job, and the note that their folder is to be deleted."""
        folder = frame_folder(job_id)
        self._blobs.delete_under(folder)
        # While the database is away it stays on the list, and there is nothing left to delete.
        with suppress(*DATABASE_OUTAGES):
            self._expiry.forget_leftovers([folder])


def frame_paths(job_id: str, hashes: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return where the frames of a job will lie, by camera, from the SHA-256 of each."""
    return {
        camera: [frame_path(job_id, camera, number, sha256) for number, sha256 in enumerate(several)]
        for camera, several in hashes.items()
    }
