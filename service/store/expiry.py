"""Expiry of frames, pictures, jobs, revisions and events: all SQL about it.

Rows first, files after. A row stops answering for its files in the transaction that puts their folder on the list of
leftovers, and the folder leaves the list once its files are gone. Whoever dies in between leaves an entry on the list:
never a row that promises what is not there, never a file that nobody knows.

The last accepted job of each venue, the one that brought its poses, is past no time, and neither are its pictures.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from itertools import takewhile

import sqlalchemy as sa

from service.store import tables
from service.store.database import Repository, advisory_lock, reading, writing
from service.store.events.outbox import CALLBACKS
from service.store.jobs.files import frame_folder, picture_folder, pictures_folder
from service.store.revisions import CALIBRATION_CAUSES
from service.store.statistics import counters

j = tables.jobs.c
r = tables.revisions.c
m = tables.memories.c
e = tables.events.c
left = tables.leftovers.c
LAST_ACCEPTED = (
    sa.select(r.job)
    .where(r.venue == j.venue, r.cause.in_(CALIBRATION_CAUSES))
    .order_by(r.number.desc())
    .limit(1)
    .correlate(tables.jobs)
    .scalar_subquery()
)
# Within the same venue: the newest revision, and the newest whose poses a job brought.
others = sa.alias(tables.revisions, "others")
NEWEST = sa.select(others.c.number).where(others.c.venue == r.venue).order_by(others.c.number.desc()).limit(1)
NEWEST_TAKEN = NEWEST.where(others.c.cause.in_(CALIBRATION_CAUSES))
NOT_THE_LAST_ACCEPTED = j.id != sa.func.coalesce(LAST_ACCEPTED, "")


@dataclass(frozen=True)
class OldFrames:
    """The frames of a job: one path of each camera, and the names of pictures that can still be drawn from them.

    `folder`: where its pictures lie.
    """

    job_id: str
    folder: str
    pictures: list[str]
    frames: dict[str, str]


class ExpiryRepository(Repository):
    """The rows and files in the database that have expired."""

    def old_frames(self, ended_before: datetime, limit: int) -> list[OldFrames]:
        """Return the frames of up to `limit` jobs that ended before a moment, the oldest first."""
        query = (
            sa.select(j.id, j.kind, j.run_token, j.pictures, j.pictures_deleted_at, j.frames)
            .where(j.finished_at < ended_before, j.frames_deleted_at.is_(None))
            .order_by(j.finished_at)
            .limit(limit)
        )
        with reading(self._engine) as connection:
            rows = connection.execute(query).all()
        return [
            OldFrames(
                row.id,
                picture_folder(row.id, row.run_token or ""),
                (row.pictures or []) if row.kind == "calibration" and row.pictures_deleted_at is None else [],
                {camera: paths[0] for camera, paths in row.frames.items() if paths},
            )
            for row in rows
        ]

    def expire_frames(self, job_ids: Collection[str], now: datetime) -> None:
        """Let ended jobs have no frames."""
        with writing(self._engine) as connection:
            advisory_lock(connection, "expiry")
            self._mark(connection, job_ids, frames_deleted_at=now)
            schedule_deletion(connection, [frame_folder(job_id) for job_id in job_ids], now)

    def expire_pictures(self, ended_before: datetime, now: datetime, limit: int) -> int:
        """Let ended jobs have no pictures, but for the last accepted job of each venue; return their number."""
        with writing(self._engine) as connection:
            advisory_lock(connection, "expiry")
            ids = self._ended(connection, ended_before, limit, j.pictures_deleted_at.is_(None), NOT_THE_LAST_ACCEPTED)
            self._mark(connection, ids, pictures_deleted_at=now)
            schedule_deletion(connection, [pictures_folder(job_id) for job_id in ids], now)
            return len(ids)

    def old_jobs(self, ended_before: datetime, limit: int) -> list[str]:
        """Return up to `limit` jobs that ended before a moment, oldest first, but the last accepted of each venue."""
        with reading(self._engine) as connection:
            return self._ended(connection, ended_before, limit, NOT_THE_LAST_ACCEPTED)

    def expire_revisions(self, before: datetime, limit: int) -> int:
        """Forget up to `limit` revisions from before a moment that calibrations brought by themselves; says how many.

        What somebody put, accepted or restored stays: there are few, and drift is measured from them. So does the
        revision that holds, the one before it, which is there to go back to, and the last whose poses a job brought.
        """
        newest, newest_taken = (which.correlate(tables.revisions).scalar_subquery() for which in (NEWEST, NEWEST_TAKEN))
        old = (
            sa.select(r.id)
            .where(r.cause == "calibrated", r.at < before, r.number < newest - 1, r.number != newest_taken)
            .order_by(r.at)
            .limit(limit)
        )
        with writing(self._engine) as connection:
            advisory_lock(connection, "expiry")
            ids = list(connection.scalars(old))
            of_them = sa.exists().where(r.id.in_(ids), r.venue == m.venue, r.number == m.revision)
            connection.execute(sa.delete(tables.memories).where(of_them))
            connection.execute(sa.delete(tables.revisions).where(r.id.in_(ids)))
            return len(ids)

    def expire_events(self, before: datetime, limit: int) -> int:
        """Forget up to `limit` events from before a moment, the oldest of all venues first; says how many.

        The newest stays: it tells who comes back whether something was missed.
        """
        with writing(self._engine) as connection:
            advisory_lock(connection, "expiry")
            newest = connection.scalar(sa.select(sa.func.max(e.id)))
            oldest = connection.execute(sa.select(e.id, e.at).order_by(e.id).limit(limit)).all()
            past = [row.id for row in takewhile(lambda row: row.at < before and row.id != newest, oldest)]
            if past:
                connection.execute(sa.delete(tables.events).where(e.id <= past[-1]))
            return len(past)

    def expire_live_minutes(self, before: datetime, limit: int) -> int:
        """Forget some `limit` minutes of live poses from before a moment, the oldest of all venues; says how many."""
        minute = tables.live_minutes.c.minute
        with writing(self._engine) as connection:
            oldest = connection.scalars(sa.select(minute).where(minute < before).order_by(minute).limit(limit)).all()
            if not oldest:
                return 0
            return connection.execute(sa.delete(tables.live_minutes).where(minute <= oldest[-1])).rowcount

    def expire_deliveries(self, before: datetime, limit: int) -> Counter[str]:
        """Give up to `limit` deliveries up whose event is from before a moment; says how many of each receiver.

        A receiver that hangs is tried so seldom that the tries of what waits for it would not end for years.
        """
        d = tables.deliveries.c
        happened_at = sa.func.coalesce(e.at, j.finished_at)
        old = (
            sa.select(d.id, d.event, d.receiver)
            .select_from(
                tables.deliveries.outerjoin(tables.events, e.id == d.event).outerjoin(tables.jobs, j.id == d.id)
            )
            .where(d.status == "waiting", sa.or_(happened_at < before, happened_at.is_(None)))
            .order_by(d.due_at)
            .limit(limit)
        )
        with writing(self._engine) as connection:
            advisory_lock(connection, "deliveries")
            rows = connection.execute(old).all()
            if not rows:
                return Counter()
            # The delivery of a job is deleted with its job, and says until then how it ended.
            of_jobs = sa.update(tables.deliveries).where(d.id.in_([row.id for row in rows if row.event is None]))
            said = sa.func.coalesce(d.last_error, "its turn did not come in time")
            connection.execute(of_jobs.values(status="given-up", last_error=said))
            of_events = [row.id for row in rows if row.event is not None]
            connection.execute(sa.delete(tables.deliveries).where(d.id.in_(of_events)))
            counters.add(connection, {(CALLBACKS, ("expired",)): len(rows)})
            return Counter(row.receiver for row in rows)

    def delete_jobs(self, job_ids: Collection[str], now: datetime) -> None:
        """Forget ended jobs with everything that is theirs; their files are to be deleted from `now` on."""
        with writing(self._engine) as connection:
            advisory_lock(connection, "expiry")
            connection.execute(sa.delete(tables.jobs).where(j.id.in_(job_ids), j.finished_at.is_not(None)))
            connection.execute(sa.delete(tables.deliveries).where(tables.deliveries.c.id.in_(job_ids)))
            schedule_deletion(
                connection, [of(job_id) for job_id in job_ids for of in (frame_folder, pictures_folder)], now
            )

    def leftovers(self, now: datetime, limit: int) -> list[str]:
        """Return up to `limit` folders whose files are to be deleted."""
        query = sa.select(left.folder).where(left.due_at <= now).order_by(left.due_at).limit(limit)
        with reading(self._engine) as connection:
            return list(connection.scalars(query))

    def forget_leftovers(self, folders: Collection[str]) -> None:
        """Remove folders from the list after their files were deleted."""
        with writing(self._engine) as connection:
            connection.execute(sa.delete(tables.leftovers).where(left.folder.in_(folders)))

    def postpone(self, folder: str, until: datetime) -> None:
        """Postpone the deletion of the files of a folder."""
        with writing(self._engine) as connection:
            connection.execute(sa.update(tables.leftovers).where(left.folder == folder).values(due_at=until))

    def _ended(
        self, connection: sa.Connection, before: datetime, limit: int, *also: sa.ColumnElement[bool]
    ) -> list[str]:
        # Open jobs have no end.
        query = sa.select(j.id).where(j.finished_at < before, *also).order_by(j.finished_at).limit(limit)
        return list(connection.scalars(query))

    def _mark(self, connection: sa.Connection, job_ids: Collection[str], **moment: datetime) -> None:
        marked = sa.update(tables.jobs).where(j.id.in_(job_ids)).values(revision=j.revision + 1, **moment)
        connection.execute(marked)


def schedule_deletion(connection: sa.Connection, folders: Collection[str], due_at: datetime) -> None:
    """Schedule the deletion of the files of folders, inside the caller's transaction."""
    connection.execute(sa.delete(tables.leftovers).where(left.folder.in_(folders)))
    rows = [{"folder": folder, "due_at": due_at} for folder in folders]
    if rows:
        connection.execute(sa.insert(tables.leftovers), rows)
