"""Jobs, from their submission to their end: all SQL about them.

The row is the one truth about a job. The engine of the queue only decides when a worker looks at it; whether there is
still something to do is decided here. Every write of a worker carries the token of its attempt (`run_token`) and
changes nothing when the job was cancelled or given to another attempt meanwhile.

Moments are the database's: the clocks of several machines differ.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.alarms import settle_alarms
from service.store.counts import tallies
from service.store.counts.figures import note_quality, note_unaccepted
from service.store.counts.outcomes import End
from service.store.deliveries import add_delivery, delivery_of
from service.store.engine import clock, reading, serialise, writing
from service.store.revisions import TAKEN, add_revision, newest_revision, revision_of_job
from service.store.venues import find_venue, put_back, save_venue, venue_lock, with_result
from service.wire.history import Cause, Revision
from service.wire.job import OPEN, Job, JobError, Kind, Progress, Status
from service.wire.options import FieldOptions, IntrinsicsOptions, LocateOptions, Options
from service.wire.results import AnyResult, Result
from service.wire.venue import Venue

PRIORITIES = {"live": 1, "routine": 100}
# Pictures to be laid over others.
LAYERS = ("seam", "stored", "new", "mask")
DONE = Progress(stage="preview", fraction=1.0)
AnyOptions = Options | IntrinsicsOptions | LocateOptions | FieldOptions
OPTIONS: dict[Kind, type[AnyOptions]] = {
    "calibration": Options,
    "intrinsics": IntrinsicsOptions,
    "locate": LocateOptions,
    "field": FieldOptions,
}
j = tables.jobs.c
# What pollers ask for, hundreds of times a second: to put the statement together takes longer than to run it.
ONE = sa.select(tables.jobs).where(j.id == sa.bindparam("job_id"))


@dataclass(frozen=True)
class Origin:
    """The request that a job came with: how the log calls it, and its place in a trace (W3C Trace Context)."""

    request_id: str | None = None
    traceparent: str | None = None

    def names(self) -> dict[str, str]:
        """For every line of the log that comes of it."""
        trace = self.traceparent.split("-")[1] if self.traceparent else None
        return {name: value for name, value in (("request", self.request_id), ("trace", trace)) if value}


@dataclass(frozen=True)
class Submission:
    """What a client sent, checked and stored: ready to become a job."""

    job_id: str
    venue: Venue | None
    options: AnyOptions
    content_hash: str
    idempotency_key: str | None
    frames: dict[str, list[str]]
    kind: Kind = "calibration"
    origin: Origin = Origin()


class KeyReused(Exception):  # noqa: N818
    """The idempotency key belongs to a job of other content."""

    def __init__(self, job_id: str) -> None:
        self.job_id = job_id


class VenueBusy(Exception):  # noqa: N818
    """The venue has an active job of other content."""

    def __init__(self, job_id: str) -> None:
        self.job_id = job_id


class VenueGone(Exception):  # noqa: N818
    """The venue was deleted while its frames arrived."""


class VenueReplaced(Exception):  # noqa: N818
    """The pitch or a lens of the venue was changed while its frames arrived: they were checked against another one."""


class NoPoses(Exception):  # noqa: N818
    """The job is no calibration that found poses (yet)."""


class MovedOn(Exception):  # noqa: N818
    """The venue is not as the job left or found it: to decide about the job would undo other changes."""

    def __init__(self, newest: Revision | None) -> None:
        self.newest = newest


class QueueFull(Exception):  # noqa: N818
    """As many jobs wait as may."""


@dataclass(frozen=True)
class Task:
    """What a worker needs to compute a job. `options` are those of its kind; only photos of a lens have no venue."""

    job_id: str
    run_token: str
    venue: Venue | None
    options: AnyOptions
    frames: dict[str, list[str]]
    kind: Kind = "calibration"
    attempt: int = 1
    origin: Origin = Origin()


@dataclass(frozen=True)
class Pictures:
    """The pictures of a job that has a result: where they lie in the blob store, and whether they still do."""

    folder: str
    names: list[str]
    deleted: bool


@dataclass(frozen=True)
class State:
    """What waiters watch: `revision` grows with every change."""

    revision: int
    status: Status


class Jobs:
    """The jobs in the database."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    # Submission

    def same_as(
        self, venue_id: str | None, idempotency_key: str | None, content_hash: str, kind: Kind = "calibration"
    ) -> Job | None:
        """The job that this content already is, so that nothing needs to be stored."""
        with reading(self._engine) as connection:
            job_id = self._duplicate(connection, kind, venue_id, idempotency_key, content_hash)
            return None if job_id is None else self._read(connection, job_id)

    def submit(
        self, submission: Submission, queue_limit: int, enqueue: Callable[[sa.Connection, str, int], None]
    ) -> tuple[Job, bool]:
        """Row and queue entry in one transaction, or the job that the content already is; also says which.

        The job begins from the poses that hold now: others may have been found since the upload began.
        """
        with writing(self._engine) as connection:
            venue_id = None if submission.venue is None else submission.venue.id
            # Those of no venue wait for each other, so that the same content sent twice at once is one job.
            serialise(connection, submission.kind if venue_id is None else venue_lock(venue_id))
            same = self._duplicate(
                connection, submission.kind, venue_id, submission.idempotency_key, submission.content_hash
            )
            if same is not None:
                return self._read(connection, same), False
            venue = self._still(connection, submission.venue)
            # From here on the frames are the job's.
            folder = frame_folder(submission.job_id)
            connection.execute(sa.delete(tables.leftovers).where(tables.leftovers.c.folder == folder))
            priority, now = PRIORITIES[submission.options.priority], clock(connection)
            connection.execute(
                sa.insert(tables.jobs).values(
                    id=submission.job_id,
                    kind=submission.kind,
                    venue=venue_id,
                    status="queued",
                    priority=priority,
                    options=submission.options.model_dump(mode="json"),
                    content_hash=submission.content_hash,
                    idempotency_key=submission.idempotency_key,
                    venue_document=venue.model_dump(mode="json") if venue else None,
                    frames=submission.frames,
                    request_id=submission.origin.request_id,
                    traceparent=submission.origin.traceparent,
                    created_at=now,
                    updated_at=now,
                )
            )
            enqueue(connection, submission.job_id, priority)
            # Last: from here to its end each submission holds up all others, so that none overshoots the limit.
            serialise(connection, "queue")
            waiting = connection.execute(sa.select(sa.func.count()).where(j.status == "queued")).scalar_one()
            if waiting > queue_limit:
                raise QueueFull
        with reading(self._engine) as connection:
            return self._read(connection, submission.job_id), True

    def _still(self, connection: sa.Connection, read: Venue | None) -> Venue | None:
        """The venue as it is now, if frames of the one that was read are frames of it."""
        if read is None:
            return None
        venue = find_venue(connection, read.id)
        if venue is None:
            raise VenueGone
        if not venue.films_like(read):
            raise VenueReplaced
        return venue

    def _duplicate(
        self,
        connection: sa.Connection,
        kind: Kind,
        venue_id: str | None,
        idempotency_key: str | None,
        content_hash: str,
    ) -> str | None:
        if idempotency_key is not None:
            # Of no venue is a place of its own.
            here = j.venue.is_(None) if venue_id is None else j.venue == venue_id
            query = sa.select(j.id, j.content_hash).where(here, j.idempotency_key == idempotency_key)
            known = connection.execute(query).one_or_none()
            if known is not None:
                if known.content_hash != content_hash:
                    raise KeyReused(known.id)
                return str(known.id)
        if kind != "calibration":
            return None
        query = sa.select(j.id, j.content_hash).where(j.venue == venue_id, j.kind == "calibration", j.status.in_(OPEN))
        active = connection.execute(query).one_or_none()
        if active is None:
            return None
        if active.content_hash != content_hash:
            raise VenueBusy(active.id)
        return str(active.id)

    # Reading

    def get(self, job_id: str) -> Job | None:
        """One job as clients see it."""
        with reading(self._engine) as connection:
            try:
                return self._read(connection, job_id)
            except sa.exc.NoResultFound:
                return None

    def page(
        self, venue: str | None, status: str | None, before: str | None, limit: int, kind: str | None = None
    ) -> list[Job]:
        """Up to `limit` jobs, newest first, those older than `before`."""
        query = sa.select(tables.jobs).order_by(j.id.desc()).limit(limit)
        for column, value in ((j.venue, venue), (j.status, status), (j.kind, kind)):
            if value is not None:
                query = query.where(column == value)
        if before is not None:
            query = query.where(j.id < before)
        with reading(self._engine) as connection:
            return [self._job(connection, row) for row in connection.execute(query)]

    def states(self, job_ids: Collection[str]) -> dict[str, State]:
        """What waiters need to know about several jobs."""
        query = sa.select(j.id, j.revision, j.status).where(j.id.in_(job_ids))
        with reading(self._engine) as connection:
            return {row.id: State(row.revision, row.status) for row in connection.execute(query)}

    def pictures(self, job_id: str) -> Pictures | None:
        """The pictures of a job, None if it has no result (yet)."""
        query = sa.select(j.run_token, j.pictures, j.pictures_deleted_at).where(j.id == job_id, j.result.is_not(None))
        with reading(self._engine) as connection:
            row = connection.execute(query).one_or_none()
        if row is None:
            return None
        return Pictures(picture_folder(job_id, row.run_token), row.pictures or [], row.pictures_deleted_at is not None)

    def submission(self, job_id: str) -> Submission | None:
        """What a job was made of; None if its frames are kept no more."""
        with reading(self._engine) as connection:
            row = connection.execute(ONE, {"job_id": job_id}).one_or_none()
            task = self._task(connection, job_id)
        if row is None or task is None or row.frames_deleted_at is not None:
            return None
        return Submission(
            job_id, task.venue, task.options, row.content_hash, row.idempotency_key, task.frames, task.kind, task.origin
        )

    def posed(self, job_id: str) -> Venue | None:
        """The venue as a calibration found it, lenses and ridge of its poses too; None: it found none (yet)."""
        done = [j.id == job_id, j.kind == "calibration", j.result.is_not(None)]
        query = sa.select(j.venue_document, j.result).where(*done)
        with reading(self._engine) as connection:
            row = connection.execute(query).one_or_none()
        if row is None:
            return None
        return with_result(Venue.model_validate(row.venue_document), Result.model_validate(row.result))

    def check(self) -> None:
        """Raise unless the database answers, and has them."""
        with reading(self._engine) as connection:
            connection.execute(sa.select(j.id).limit(1))

    # Working

    def begin(self, job_id: str) -> Task | None:
        """Start an attempt; None if there is nothing to do any more."""
        with writing(self._engine) as connection:
            now = clock(connection)
            begin = (
                sa.update(tables.jobs)
                .where(j.id == job_id, j.status.in_(OPEN))
                .values(
                    status="running",
                    run_token=uuid.uuid4().hex,
                    attempt=j.attempt + 1,
                    started_at=sa.func.coalesce(j.started_at, now, type_=j.started_at.type),
                    progress=None,
                    **_changed(now),
                )
            )
            if connection.execute(begin).rowcount == 0:
                return None
            return self._task(connection, job_id)

    def task(self, job_id: str, run_token: str) -> Task | None:
        """What to compute; None if the attempt has lost the job."""
        with reading(self._engine) as connection:
            task = self._task(connection, job_id)
            return task if task is not None and task.run_token == run_token else None

    def holds(self, task: Task) -> bool:
        """Whether the job is still this attempt's; False if it has lost it, to a cancellation or to another attempt."""
        with reading(self._engine) as connection:
            return connection.scalar(sa.select(j.id).where(*_fence(task))) is not None

    def keep(self, task: Task) -> bool:
        """A sign of life of an attempt; False if it has lost the job."""
        with writing(self._engine) as connection:
            alive = sa.update(tables.jobs).where(*_fence(task)).values(updated_at=clock(connection))
            return connection.execute(alive).rowcount == 1

    def report(self, task: Task, progress: Progress) -> None:
        """Show how far the job is."""
        with writing(self._engine) as connection:
            shown = {"progress": progress.model_dump(), **_changed(clock(connection))}
            connection.execute(sa.update(tables.jobs).where(*_fence(task)).values(**shown))

    def finish(self, task: Task, result: AnyResult, pictures: Sequence[str]) -> None:
        """End a job with a result and the names of its pictures.

        If the result is that of a calibration and accepted, the stored poses move in the same transaction.
        """
        with writing(self._engine) as connection:
            if task.venue is not None:
                serialise(connection, venue_lock(task.venue.id))
            # Locked: a cancellation must come before this end or after it, not between the row and the poses.
            if connection.scalar(sa.select(j.id).where(*_fence(task)).with_for_update()) is None:
                return
            if isinstance(result, Result):
                result = self._move_poses(connection, task, result)
            self._end(
                connection,
                task.job_id,
                _fence(task),
                "succeeded",
                result=result,
                pictures=list(pictures),
                progress=DONE.model_dump(),
            )

    def _move_poses(self, connection: sa.Connection, task: Task, result: Result) -> Result:
        """Let the new poses hold if they are accepted, and note what the result says about the venue.

        Gives the result with what the venue has to say about that.
        """
        assert task.venue is not None
        assert isinstance(task.options, Options)
        now_stored = find_venue(connection, task.venue.id)
        if now_stored is None or not now_stored.calibrates_like(task.venue):
            changed = {"accepted": False, "rejected_because": "the venue was changed while the job ran"}
            return result.model_copy(update=changed) if result.accepted else result
        moves = result.accepted and not task.options.dry_run
        note_quality(connection, task.venue.id, result, clock(connection), moved=moves)
        if moves:
            self._take(connection, with_result(now_stored, result), "calibrated", task.job_id, result)
        elif not task.options.dry_run:
            self._miss(connection, now_stored)
        return result

    def fail(self, task: Task, error: JobError) -> None:
        """End a job without a result."""
        with writing(self._engine) as connection:
            self._fail(connection, task.job_id, _fence(task), error)

    def cancel(self, job_id: str) -> None:
        """End a job that is still open; its worker notices."""
        with writing(self._engine) as connection:
            self._end(connection, job_id, _open(job_id), "cancelled")

    # By hand

    def accept(self, job_id: str) -> None:
        """Let the poses that a calibration found hold, whatever the gate said; nothing to do if they do.

        Raises `MovedOn` if the venue is not the one that the calibration began with, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, result, newest = self._found(connection, job_id)
            if newest is not None and newest.job == job_id and newest.cause in TAKEN:
                return
            now_stored = find_venue(connection, began_with.id)
            if now_stored is None or not now_stored.calibrates_like(began_with):
                raise MovedOn(newest)
            note_quality(connection, began_with.id, result, clock(connection), moved=True)
            self._take(connection, with_result(now_stored, result), "accepted", job_id, result)
            self._touch(connection, job_id)

    def reject(self, job_id: str) -> None:
        """Put back what was before a calibration's poses held; nothing to do if they never did or were put back.

        Raises `MovedOn` if something else has come since, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, _, newest = self._found(connection, job_id)
            if newest is None or revision_of_job(connection, job_id) is None:
                return
            if newest.job != job_id:
                raise MovedOn(newest)
            if newest.cause in TAKEN:
                now_stored = find_venue(connection, began_with.id)
                assert now_stored is not None
                settle_alarms(connection, put_back(connection, now_stored, newest.revision - 1, rejected_job=job_id))
                self._touch(connection, job_id)

    def _found(self, connection: sa.Connection, job_id: str) -> tuple[Venue, Result, Revision | None]:
        """What a calibration began with and what it found, and the revision that its venue is at, which stays."""
        done = [j.id == job_id, j.kind == "calibration", j.result.is_not(None)]
        row = connection.execute(sa.select(j.venue, j.venue_document, j.result).where(*done)).one_or_none()
        if row is None:
            raise NoPoses
        serialise(connection, venue_lock(row.venue))
        newest = newest_revision(connection, row.venue)
        return Venue.model_validate(row.venue_document), Result.model_validate(row.result), newest

    def _touch(self, connection: sa.Connection, job_id: str) -> None:
        connection.execute(sa.update(tables.jobs).where(j.id == job_id).values(**_changed(clock(connection))))

    # Tidying

    def unchanged_for(self, seconds: float) -> list[str]:
        """Open jobs that nothing was heard of for a while."""
        with reading(self._engine) as connection:
            before = clock(connection) - timedelta(seconds=seconds)
            query = sa.select(j.id).where(j.status.in_(OPEN), j.updated_at < before)
            return list(connection.scalars(query.order_by(j.updated_at).limit(100)))

    def abandon(self, job_id: str, error: JobError) -> bool:
        """End an open job that the queue has given up; False if it has ended meanwhile."""
        with writing(self._engine) as connection:
            return self._fail(connection, job_id, _open(job_id), error)

    # Parts

    def _take(self, connection: sa.Connection, venue: Venue, cause: Cause, job_id: str, result: Result) -> None:
        """Let a venue be as a calibration found it."""
        save_venue(connection, venue)
        add_revision(connection, venue, cause, job_id, stitch_error_px=result.stitch_error_px)
        settle_alarms(connection, venue)

    def _miss(self, connection: sa.Connection, venue: Venue) -> None:
        """A calibration that was to bring poses brought none."""
        note_unaccepted(connection, venue.id)
        settle_alarms(connection, venue)

    def _fail(
        self, connection: sa.Connection, job_id: str, still: list[sa.ColumnElement[bool]], error: JobError
    ) -> bool:
        row = connection.execute(sa.select(j.kind, j.venue, j.options).where(j.id == job_id)).one()
        if row.kind != "calibration" or row.options["dry_run"]:
            return self._end(connection, job_id, still, "failed", error=error)
        serialise(connection, venue_lock(row.venue))
        ended = self._end(connection, job_id, still, "failed", error=error)
        venue = find_venue(connection, row.venue)
        if ended and venue is not None:
            self._miss(connection, venue)
        return ended

    def _end(
        self,
        connection: sa.Connection,
        job_id: str,
        still: list[sa.ColumnElement[bool]],
        status: Status,
        *,
        result: AnyResult | None = None,
        error: JobError | None = None,
        **values: Any,
    ) -> bool:
        now = clock(connection)
        for name, document in (("result", result), ("error", error)):
            if document is not None:
                values[name] = document.model_dump(mode="json")
        end = sa.update(tables.jobs).where(*still).values(status=status, finished_at=now, **values, **_changed(now))
        if connection.execute(end).rowcount == 0:
            return False
        query = sa.select(j.kind, j.options, j.created_at, j.started_at, j.attempt).where(j.id == job_id)
        row = connection.execute(query).one()
        options = OPTIONS[row.kind].model_validate(row.options)
        if options.callback_url is not None:
            add_delivery(connection, job_id, options.callback_url, now)
        ended = End(row.kind, status, result, error, row.created_at, row.started_at, now, row.attempt)
        tallies.add(connection, ended.tallies())
        return True

    def _task(self, connection: sa.Connection, job_id: str) -> Task | None:
        row = connection.execute(ONE, {"job_id": job_id}).one_or_none()
        if row is None:
            return None
        return Task(
            row.id,
            row.run_token,
            None if row.venue_document is None else Venue.model_validate(row.venue_document),
            OPTIONS[row.kind].model_validate(row.options),
            row.frames,
            row.kind,
            row.attempt,
            Origin(row.request_id, row.traceparent),
        )

    def _read(self, connection: sa.Connection, job_id: str) -> Job:
        return self._job(connection, connection.execute(ONE, {"job_id": job_id}).one())

    def _job(self, connection: sa.Connection, row: Any) -> Job:
        return Job(
            id=row.id,
            kind=row.kind,
            venue=row.venue,
            status=row.status,
            progress=row.progress,
            queue_position=self._position(connection, row) if row.status == "queued" else None,
            attempt=row.attempt,
            created_at=row.created_at,
            started_at=row.started_at,
            finished_at=row.finished_at,
            error=row.error,
            result=row.result,
            callback=delivery_of(connection, row.id) if row.finished_at and row.options["callback_url"] else None,
            venue_revision=revision_of_job(connection, row.id) if row.kind == "calibration" and row.result else None,
            links=_links(row),
        )

    def _position(self, connection: sa.Connection, row: Any) -> int:
        ahead = sa.or_(j.priority < row.priority, sa.and_(j.priority == row.priority, j.id < row.id))
        # First poses have a queue of their own.
        same_queue = (j.kind == "locate") if row.kind == "locate" else (j.kind != "locate")
        count = connection.scalar(sa.select(sa.func.count()).where(j.status == "queued", same_queue, ahead))
        return 1 + (count or 0)


def frame_folder(job_id: str) -> str:
    """Where the frames of a job lie in the blob store."""
    return f"frames/{job_id}"


def pictures_folder(job_id: str) -> str:
    """Where the pictures of all attempts of a job lie in the blob store."""
    return f"pictures/{job_id}"


def picture_folder(job_id: str, run_token: str) -> str:
    """Each attempt has pictures of its own, so that one given up late cannot overwrite those of the next."""
    return f"{pictures_folder(job_id)}/{run_token}"


def picture_file(name: str) -> str:
    """What the file of a picture is called: `overlay_left.jpg`; layers, which can be seen through, `mask_left.png`."""
    return f"{name}.{'png' if name.partition('_')[0] in LAYERS else 'jpg'}"


def _fence(task: Task) -> list[sa.ColumnElement[bool]]:
    return [j.id == task.job_id, j.run_token == task.run_token, j.status == "running"]


def _open(job_id: str) -> list[sa.ColumnElement[bool]]:
    return [j.id == job_id, j.status.in_(OPEN)]


def _changed(now: datetime) -> dict[str, Any]:
    return {"revision": j.revision + 1, "updated_at": now}


def _links(row: Any) -> dict[str, str]:
    base = f"/jobs/{row.id}"
    links = {"self": base, "events": f"{base}/events", "cancel": f"{base}/cancel"}
    if row.venue is not None:
        links["venue"] = f"/venues/{row.venue}"
    # `overlay_left` in the store is `overlay/left` in an address.
    names = row.pictures or () if row.pictures_deleted_at is None else ()
    return links | {name.replace("_", "/", 1): f"{base}/{picture_file(name).replace('_', '/', 1)}" for name in names}
