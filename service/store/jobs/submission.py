"""Submission: frames and options of a client become a job, or are found to be one already."""

import hashlib
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.schemas.job import Job, JobError
from service.schemas.names import JobKind, JobStatus
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import Repository, advisory_lock, clock, lock_venue, reading, writing
from service.store.documents import to_document
from service.store.events.event_log import add_queued_event
from service.store.expiry import schedule_deletion
from service.store.jobs.attempts import Enqueue
from service.store.jobs.ending import End, end_job
from service.store.jobs.files import frame_folder
from service.store.jobs.queries import ONE, job_input_values, read_job
from service.store.jobs.task import JobInput, parse_job_input
from service.store.refusals import RETRY_AFTER_S, venue_busy, venue_is_stored
from service.store.schedules import reserved_places
from service.store.venues import existing_venue, find_venue

PRIORITIES = {"live": 1, "routine": 100}
# Prefix of the content hash of a job whose frames were fetched.
FETCHED = "fetched "
j = tables.jobs.c


class Submission(JobInput):
    """A checked request for a job, ready to become one once its frames are stored."""

    content_hash: str
    idempotency_key: str | None

    @property
    def hash_again(self) -> str:
        """The content hash of these frames sent once more.

        Frames that were fetched once are not what the cameras show now: who asks for that is to get another job.
        """
        fetched = self.content_hash.startswith(FETCHED)
        return hashlib.sha256(self.job_id.encode()).hexdigest() if fetched else self.content_hash


def fetched_hash(options: Options) -> str:
    """The content hash of what the cameras show at the time, which is not known before."""
    return FETCHED + hashlib.sha256(options.model_dump_json().encode()).hexdigest()[: 64 - len(FETCHED)]


class SubmissionRepository(Repository):
    """The beginning of the jobs in the database."""

    def announce(self, submission: Submission, queue_limit: int, grace: timedelta) -> Job | None:
        """Return the job that the content already is; else None, and its frames may be stored.

        Unless these become the job within the `grace`, they are deleted. Raises the problem `queue-full`.
        """
        with writing(self._engine) as connection:
            same = _duplicate(
                connection, submission.kind, submission.venue_id, submission.idempotency_key, submission.content_hash
            )
            if same is not None:
                return read_job(connection, same)
            _require_place(connection, _waiting(connection), queue_limit, is_schedule=submission.origin.is_schedule)
            schedule_deletion(connection, [frame_folder(submission.job_id)], clock(connection) + grace)
            return None

    def submit(self, submission: Submission, queue_limit: int, enqueue: Enqueue) -> tuple[Job, bool]:
        """Row and queue entry in one transaction, or the job that the content already is; also says which.

        The job begins from the poses that hold now: others may have been found since the upload began.
        """
        with writing(self._engine) as connection:
            venue_id = submission.venue_id
            if venue_id is None:
                # They wait for each other, so that the same content sent twice at once is one job.
                advisory_lock(connection, submission.kind)
            else:
                lock_venue(connection, venue_id)
            same = _duplicate(
                connection, submission.kind, venue_id, submission.idempotency_key, submission.content_hash
            )
            if same is not None:
                return read_job(connection, same), False
            if submission.site is not None and find_venue(connection, submission.site.id) is not None:
                raise venue_is_stored(submission.site.id)
            venue = None if submission.venue is None else _as_it_is_now(connection, submission.venue)
            # From here on the frames are the job's.
            folder = frame_folder(submission.job_id)
            connection.execute(sa.delete(tables.leftovers).where(tables.leftovers.c.folder == folder))
            _insert(connection, submission, venue, "queued", clock(connection))
            job = read_job(connection, submission.job_id)
            if venue is not None:
                add_queued_event(connection, venue, job, submission.origin.actor)
            priority = PRIORITIES[submission.options.priority]
            enqueue(connection, submission.job_id, priority, submission.kind)
            # Last: from here to its end each submission holds up all others, so that none overshoots the limit.
            advisory_lock(connection, "queue")
            _require_place(connection, _waiting(connection) - 1, queue_limit, is_schedule=submission.origin.is_schedule)
            return job, True

    def fail(self, submission: Submission, error: JobError) -> Job:
        """A job that failed before it had frames, or the job that the submission already is by its key."""
        assert submission.venue is not None
        with writing(self._engine) as connection:
            lock_venue(connection, submission.venue.id)
            same = _of_key(connection, submission.venue.id, submission.idempotency_key)
            if same is None:
                venue, now = _as_it_is_now(connection, submission.venue), clock(connection)
                _insert(connection, submission, venue, "failed", now, frames_deleted_at=now)
                end_job(connection, submission.job_id, [j.id == submission.job_id], End("failed", error=error))
        with reading(self._engine) as connection:
            return read_job(connection, submission.job_id if same is None else same.id)

    def waiting(self) -> int:
        """Return the number of queued jobs."""
        with reading(self._engine) as connection:
            return _waiting(connection)

    def require_place(self, queue_limit: int, *, is_schedule: bool) -> None:
        """Raise the problem `queue-full` unless the queue has a place for a job that is submitted now."""
        with reading(self._engine) as connection:
            _require_place(connection, _waiting(connection), queue_limit, is_schedule=is_schedule)

    def require_place_for(
        self, venue_id: str | None, idempotency_key: str | None, kind: JobKind, queue_limit: int
    ) -> None:
        """Raise the problem `queue-full` unless the queue has a place, or the request may be an old job sent again."""
        with reading(self._engine) as connection:
            if _of_key(connection, venue_id, idempotency_key) is not None:
                return
            active = sa.select(j.id).where(j.venue == venue_id, tables.ACTIVE)
            if kind == "calibration" and connection.execute(active).first() is not None:
                return
            _require_place(connection, _waiting(connection), queue_limit, is_schedule=False)

    def same_as(
        self, venue_id: str | None, idempotency_key: str | None, content_hash: str, kind: JobKind = "calibration"
    ) -> Job | None:
        """The job that this content already is, so that nothing needs to be stored."""
        with reading(self._engine) as connection:
            job_id = _duplicate(connection, kind, venue_id, idempotency_key, content_hash)
            return None if job_id is None else read_job(connection, job_id)

    def of(self, job_id: str) -> Submission | None:
        """Return what a job was made of; None after its frames have expired. Raises `UnreadableJob`."""
        with reading(self._engine) as connection:
            row = connection.execute(ONE, {"job_id": job_id}).one_or_none()
        if row is None or row.frames_deleted_at is not None:
            return None
        sent = {"content_hash": row.content_hash, "idempotency_key": row.idempotency_key}
        return parse_job_input(Submission, job_input_values(row) | sent)


def _insert(
    connection: sa.Connection,
    submission: Submission,
    venue: Venue | None,
    status: JobStatus,
    now: datetime,
    **more: Any,
) -> None:
    values = {
        "id": submission.job_id,
        "kind": submission.kind,
        "venue": submission.venue_id,
        "status": status,
        "priority": PRIORITIES[submission.options.priority],
        "options": submission.options.model_dump(mode="json"),
        "content_hash": submission.content_hash,
        "idempotency_key": submission.idempotency_key,
        "venue_document": None if venue is None else to_document(venue),
        "site": None if submission.site is None else to_document(submission.site),
        "frames": submission.frames,
        "asked_by": submission.origin.asked_by,
        "address": submission.origin.address,
        "request_id": submission.origin.request_id,
        "traceparent": submission.origin.traceparent,
        "created_at": now,
        "updated_at": now,
    }
    connection.execute(sa.insert(tables.jobs).values(values | more))


def _require_place(connection: sa.Connection, before: int, queue_limit: int, *, is_schedule: bool) -> None:
    """Raise the problem `queue-full` unless a job may wait behind the jobs that wait `before` it.

    Whoever submits again and again would else take every place that becomes free before a schedule sees it. So a place
    is kept for each schedule that is due, in half of the queue at most.
    """
    most_kept = (queue_limit + 1) // 2
    if before < queue_limit and (is_schedule or before + most_kept < queue_limit):
        return
    kept = 0 if before >= queue_limit else reserved_places(connection, clock(connection), most_kept)
    if before + kept >= queue_limit:
        why = f", and {kept} of {queue_limit} places are kept for schedules that are due" if kept else ""
        raise Problem("queue-full", f"{before} jobs wait{why}; try again.", headers={"Retry-After": "30"})


def _waiting(connection: sa.Connection) -> int:
    return connection.execute(sa.select(sa.func.count()).where(j.status == "queued")).scalar_one()


def _as_it_is_now(connection: sa.Connection, read: Venue) -> Venue:
    """Return the stored venue; raises a problem if it is gone, or frames of the one that was `read` do not fit it."""
    venue = existing_venue(connection, read.id)
    if not venue.accepts_frames_of(read):
        raise Problem(
            "venue-replaced",
            "Its pitch, cameras or lenses were changed while the frames arrived; see that they fit and send again.",
            headers={"Retry-After": str(RETRY_AFTER_S)},
        )
    return venue


def _duplicate(
    connection: sa.Connection, kind: JobKind, venue_id: str | None, idempotency_key: str | None, content_hash: str
) -> str | None:
    known = _of_key(connection, venue_id, idempotency_key)
    if known is not None:
        if known.content_hash != content_hash:
            raise _key_reused(known.id)
        return str(known.id)
    if kind != "calibration":
        return None
    query = sa.select(j.id, j.content_hash, j.idempotency_key).where(j.venue == venue_id, tables.ACTIVE)
    active = connection.execute(query).one_or_none()
    if active is None:
        return None
    if active.content_hash != content_hash:
        # Without the lock, the job of this key may have come since the key was looked up.
        if idempotency_key is not None and active.idempotency_key == idempotency_key:
            raise _key_reused(active.id)
        raise venue_busy(active.id)
    return str(active.id)


def _key_reused(job_id: str) -> Problem:
    return Problem("idempotency-key-reused", "Use a new key for new frames.", job=job_id)


def _of_key(connection: sa.Connection, venue_id: str | None, idempotency_key: str | None) -> Any:
    """Id and content hash of the job of a key, None if there is none."""
    if idempotency_key is None:
        return None
    # Jobs without a venue have a namespace of their own.
    here = j.venue.is_(None) if venue_id is None else j.venue == venue_id
    query = sa.select(j.id, j.content_hash).where(here, j.idempotency_key == idempotency_key)
    return connection.execute(query).one_or_none()
