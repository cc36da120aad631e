"""Jobs as clients see them, and what waits for them watches."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.engine import Repository, reading
from service.store.jobs.files import picture_file, picture_folder
from service.store.jobs.task import Origin
from service.store.revisions import revisions_of_jobs
from service.store.told.deliveries import deliveries_of
from service.store.venues import with_result
from service.wire.job import CallbackState, Job
from service.wire.names import Status
from service.wire.results import Result
from service.wire.venue import Venue

j = tables.jobs.c
# What pollers ask for, hundreds of times a second: to put the statement together takes longer than to run it.
ONE = sa.select(tables.jobs).where(j.id == sa.bindparam("job_id"))
# First poses have a queue of their own.
PLACE = sa.func.row_number().over(partition_by=j.kind == "locate", order_by=(j.priority, j.id))
QUEUE = sa.select(j.id, PLACE.label("position")).where(j.status == "queued").subquery()


@dataclass(frozen=True)
class Pictures:
    """The pictures of a job that has a result: where they lie in the blob store, and whether they still do."""

    folder: str
    names: list[str]
    deleted: bool


@dataclass(frozen=True)
class Drawable:
    """What a calibration began with and found, and the path of a frame of each camera."""

    venue: Venue
    result: Result
    frames: dict[str, str]


@dataclass(frozen=True)
class State:
    """What waiters watch: `revision` grows with every change."""

    revision: int
    status: Status


class Jobs(Repository):
    """The jobs in the database."""

    def get(self, job_id: str) -> Job | None:
        """One job as clients see it."""
        with reading(self._engine) as connection:
            try:
                return read_job(connection, job_id)
            except sa.exc.NoResultFound:
                return None

    def several(self, job_ids: Collection[str]) -> dict[str, Job]:
        """Those of several jobs that are there, by their ids."""
        with reading(self._engine) as connection:
            return jobs_of(connection, job_ids)

    def page(
        self, venue: str | None, status: str | None, before: str | None, limit: int, kind: str | None = None
    ) -> list[Job]:
        """Up to `limit` jobs, newest first, those older than `before`."""
        query = sa.select(tables.jobs).order_by(j.id.desc()).limit(limit)
        if venue is not None:
            query = query.with_hint(*tables.BY_VENUE)
        for column, value in ((j.venue, venue), (j.status, status), (j.kind, kind)):
            if value is not None:
                query = query.where(column == value)
        if before is not None:
            query = query.where(j.id < before)
        with reading(self._engine) as connection:
            return _jobs(connection, connection.execute(query).all())

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

    def drawable(self, job_id: str) -> Drawable | None:
        """What pictures of a calibration can be drawn of; None: it has no result, or is no calibration."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
            if found is None:
                return None
            frames = connection.execute(sa.select(j.frames).where(j.id == job_id)).scalar_one()
        return Drawable(*found, {camera: paths[0] for camera, paths in frames.items()})

    def posed(self, job_id: str) -> Venue | None:
        """The venue as a calibration found it, lenses and ridge of its poses too; None: it found none (yet)."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
        return None if found is None else with_result(*found)

    def frame(self, job_id: str, number: int) -> str | None:
        """Where a frame of a job lies in the blob store, counted through all of them; None: there is none."""
        query = sa.select(j.frames).where(j.id == job_id, j.frames_deleted_at.is_(None))
        with reading(self._engine) as connection:
            frames = connection.execute(query).scalar_one_or_none() or {}
        paths = [path for several in frames.values() for path in several]
        return paths[number] if number < len(paths) else None

    def check(self) -> None:
        """Raise unless the database answers, and has them."""
        with reading(self._engine) as connection:
            connection.execute(sa.select(j.id).limit(1))


def read_job(connection: sa.Connection, job_id: str) -> Job:
    """One job as clients see it, which is there."""
    return _jobs(connection, [connection.execute(ONE, {"job_id": job_id}).one()])[0]


def jobs_of(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, Job]:
    """Those of several jobs that are there, as clients see them."""
    rows = connection.execute(sa.select(tables.jobs).where(j.id.in_(job_ids))).all() if job_ids else []
    return {job.id: job for job in _jobs(connection, rows)}


def found_poses(connection: sa.Connection, job_id: str) -> tuple[Venue, Result] | None:
    """What a calibration began with and what it found; None: it found no poses (yet), or the job is no calibration."""
    done = [j.id == job_id, j.kind == "calibration", j.result.is_not(None)]
    row = connection.execute(sa.select(j.venue_document, j.result).where(*done)).one_or_none()
    return None if row is None else (Venue.model_validate(row.venue_document), Result.model_validate(row.result))


def asked(row: Any) -> dict[str, Any]:
    """What was asked of a job, as the members of `Asked`."""
    return {
        "job_id": row.id,
        "kind": row.kind,
        "venue": row.venue_document,
        "options": row.options,
        "frames": row.frames,
        "origin": Origin(row.request_id, row.traceparent, row.asked_by),
    }


def _jobs(connection: sa.Connection, rows: Sequence[Any]) -> list[Job]:
    """What is known of them beside their rows is read of all at once."""
    positions = _positions(connection, [row.id for row in rows if row.status == "queued"])
    callbacks = deliveries_of(connection, [row.id for row in rows if row.finished_at and row.options["callback_url"]])
    taken = revisions_of_jobs(connection, [row.id for row in rows if row.kind == "calibration" and row.result])
    return [_job(row, positions.get(row.id), callbacks.get(row.id), taken.get(row.id)) for row in rows]


def _job(row: Any, position: int | None, callback: CallbackState | None, revision: int | None) -> Job:
    return Job(
        id=row.id,
        kind=row.kind,
        venue=row.venue,
        status=row.status,
        progress=row.progress,
        queue_position=position,
        attempt=row.attempt,
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        error=row.error,
        result=row.result,
        callback=callback,
        asked_by=row.asked_by,
        # An address may be a secret, and how far its telling has come is said by `callback`.
        options={name: value for name, value in row.options.items() if name != "callback_url"},
        frames=_frames(row),
        venue_revision=revision,
        links=_links(row),
    )


def _frames(row: Any) -> dict[str, list[str]]:
    """By camera, or by the names of photos, addresses that count through all of them."""
    if row.frames_deleted_at is not None:
        return {}
    number = count()
    return {name: [f"/jobs/{row.id}/frames/{next(number)}" for _ in paths] for name, paths in row.frames.items()}


def _positions(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, int]:
    """The places of jobs that wait, from 1."""
    if not job_ids:
        return {}
    query = sa.select(QUEUE).where(QUEUE.c.id.in_(job_ids))
    return {row.id: row.position for row in connection.execute(query)}


def _links(row: Any) -> dict[str, str]:
    base = f"/jobs/{row.id}"
    links = {"self": base, "events": f"{base}/events", "cancel": f"{base}/cancel"}
    if row.venue is not None:
        links["venue"] = f"/venues/{row.venue}"
    # `overlay_left` in the store is `overlay/left` in an address.
    names = row.pictures or () if row.pictures_deleted_at is None else ()
    return links | {name.replace("_", "/", 1): f"{base}/{picture_file(name).replace('_', '/', 1)}" for name in names}
