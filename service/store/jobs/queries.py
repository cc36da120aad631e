"""Jobs as clients see them, and their states for long polls and streams."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import PurePath
from typing import Any

import sqlalchemy as sa

from service.schemas.base import TOLERANTLY, Unreadable
from service.schemas.find import SoughtSite
from service.schemas.job import CallbackState, Job, JobSummary
from service.schemas.names import OWN_QUEUES, JobKind, JobStatus
from service.schemas.options import FindOptions
from service.schemas.results import NO_CHOICE, FindResult, Result
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import Repository, reading
from service.store.documents import stored_result, stored_venue
from service.store.events.outbox import deliveries_of
from service.store.jobs.files import picture_address, picture_file, picture_folder
from service.store.jobs.task import Origin
from service.store.revisions import revisions_of_jobs
from service.store.unreadable import read_each, reading_row
from service.store.venue_fold import with_result

j = tables.jobs.c
BRING_POSES: tuple[JobKind, ...] = ("calibration", "find")
# Built once: pollers ask for it hundreds of times a second, and building the statement takes longer than running it.
ONE = sa.select(tables.jobs).where(j.id == sa.bindparam("job_id"))
LANE = sa.case((j.kind.in_(list(OWN_QUEUES)), j.kind), else_="")
PLACE = sa.func.row_number().over(partition_by=LANE, order_by=(j.priority, j.id))
QUEUE = sa.select(j.id, PLACE.label("position")).where(j.status == "queued").subquery()


@dataclass(frozen=True)
class Pictures:
    """The pictures of a job that has a result: where they lie in the blob store, and whether they still do."""

    folder: str
    names: list[str]
    deleted: bool


@dataclass(frozen=True)
class Drawable:
    """The input and result of a calibration, and the path of a frame of each camera."""

    venue: Venue
    result: Result
    frames: dict[str, str]


@dataclass(frozen=True)
class FoundSite:
    """Answer of a search for cameras, with the venue that it `began_with`, None where that was not stored yet."""

    began_with: Venue | None
    site: SoughtSite
    result: FindResult

    def venue(self, choice: Mapping[str, int | None] = NO_CHOICE) -> Venue:
        """The venue with the chosen candidates, see `FindResult.chosen`; raises as `SoughtSite.completed`."""
        return self.site.completed(self.result, self.result.chosen(choice)).to_venue()


@dataclass(frozen=True)
class JobState:
    """The state of a job that long polls and streams watch: `revision` grows with every change."""

    revision: int
    status: JobStatus


@dataclass(frozen=True)
class JobPage:
    """Filters of a page of jobs: up to `limit`, newest first, by the filters that are not None.

    `before`: those older than this job. `only`: those of these venues; None: all, also those that belong to no venue.
    """

    limit: int
    before: str | None = None
    venue: str | None = None
    status: str | None = None
    kind: str | None = None
    only: Collection[str] | None = None

    def query(self, *columns: Any) -> sa.Select[Any]:
        """Return the query for these columns of the page's jobs, and of one more."""
        query = sa.select(*columns).order_by(j.id.desc()).limit(self.limit + 1)
        if self.venue is not None:
            query = query.with_hint(*tables.BY_VENUE)
        for column, value in ((j.venue, self.venue), (j.status, self.status), (j.kind, self.kind)):
            if value is not None:
                query = query.where(column == value)
        if self.before is not None:
            query = query.where(j.id < self.before)
        if self.only is not None:
            query = query.where(j.venue.in_(self.only))
        return query


@dataclass(frozen=True)
class FoundJobs:
    """Jobs of a page, newest first, or a line of each; those of it that cannot be read; the last id of a full page."""

    jobs: list[Job]
    summaries: list[JobSummary]
    unreadable: list[Unreadable]
    next_cursor: str | None


class JobRepository(Repository):
    """The jobs in the database."""

    def get(self, job_id: str) -> Job | None:
        """Return one job as clients see it; None: there is none. Raises `UnreadableRow`."""
        with reading(self._engine) as connection:
            try:
                return read_job(connection, job_id)
            except sa.exc.NoResultFound:
                return None

    def several(self, job_ids: Collection[str]) -> dict[str, Job]:
        """Return those of several jobs that exist, by id."""
        with reading(self._engine) as connection:
            return jobs_of(connection, job_ids)

    def page(self, wanted: JobPage) -> FoundJobs:
        """Return the jobs of a page, newest first."""
        with reading(self._engine) as connection:
            rows, next_cursor = _rows_of(connection, wanted, tables.jobs)
            jobs, unreadable = _jobs(connection, rows)
            return FoundJobs(jobs, [], unreadable, next_cursor)

    def summaries(self, wanted: JobPage) -> FoundJobs:
        """Return a line for each job of a page, newest first, without reading their results."""
        found = {
            "verdict": j.result["verdict"].as_string().label("verdict"),
            "stitch_error_px": j.result["stitch_error_px"].as_float().label("stitch_error_px"),
        }
        columns = [found[name] if name in found else j[name] for name in JobSummary.model_fields]
        with reading(self._engine) as connection:
            rows, next_cursor = _rows_of(connection, wanted, *columns)
        summaries, unreadable = read_each(rows, _summary)
        return FoundJobs([], summaries, unreadable, next_cursor)

    def venue_of(self, job_id: str) -> str | None:
        """The id of the venue of a job; None: it belongs to none, or there is no such job."""
        with reading(self._engine) as connection:
            venue_id: str | None = connection.scalar(sa.select(j.venue).where(j.id == job_id))
            return venue_id

    def states(self, job_ids: Collection[str]) -> dict[str, JobState]:
        """Return the states of several jobs, by id."""
        query = sa.select(j.id, j.revision, j.status).where(j.id.in_(job_ids))
        with reading(self._engine) as connection:
            return {row.id: JobState(row.revision, row.status) for row in connection.execute(query)}

    def pictures(self, job_id: str) -> Pictures | None:
        """The pictures of a job, None if it has no result (yet)."""
        query = sa.select(j.run_token, j.pictures, j.pictures_deleted_at).where(j.id == job_id, j.result.is_not(None))
        with reading(self._engine) as connection:
            row = connection.execute(query).one_or_none()
        if row is None:
            return None
        return Pictures(picture_folder(job_id, row.run_token), row.pictures or [], row.pictures_deleted_at is not None)

    def drawable(self, job_id: str) -> Drawable | None:
        """Return what pictures of a calibration are drawn from; None without a result or for other kinds of jobs."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
            if found is None:
                return None
            frames = connection.execute(sa.select(j.frames).where(j.id == job_id)).scalar_one()
        return Drawable(*found, {camera: paths[0] for camera, paths in frames.items()})

    def posed(self, job_id: str) -> Venue | None:
        """The venue as a job found it, lenses and ridge of its poses too; None: it found none (yet).

        Of cameras that were looked for, those that were accepted.
        """
        with reading(self._engine) as connection:
            found, site = found_poses(connection, job_id), found_site(connection, job_id)
        if site is not None:
            return site.venue() if any(camera.accepted for camera in site.result.cameras) else None
        return None if found is None else with_result(*found)

    def frame(self, job_id: str, number: int) -> str | None:
        """Return the path of a frame of a job by its number through all cameras, or None if there is none."""
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
    """Return one job as clients see it, which is there. Raises `UnreadableRow`."""
    row = connection.execute(ONE, {"job_id": job_id}).one()
    return _reader(connection, [row])(row)


def jobs_of(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, Job]:
    """Return those of several jobs that are there and can be read, as clients see them."""
    rows = connection.execute(sa.select(tables.jobs).where(j.id.in_(job_ids))).all() if job_ids else []
    return {job.id: job for job in _jobs(connection, rows)[0]}


def found_poses(connection: sa.Connection, job_id: str) -> tuple[Venue, Result] | None:
    """Return the input and result of a calibration; None if it has no result (yet), or the job is no calibration."""
    done = [j.id == job_id, j.kind == "calibration", j.result.is_not(None)]
    query = sa.select(j.id, j.venue_document, j.result)
    row = connection.execute(query.where(*done)).one_or_none()
    if row is None:
        return None
    with reading_row("job", job_id):
        return stored_venue(row.venue_document), stored_result(row.result)


def found_site(connection: sa.Connection, job_id: str) -> FoundSite | None:
    """Return the answer of a search for cameras; None for a job without a result (yet), or of another kind."""
    row = connection.execute(ONE, {"job_id": job_id}).one_or_none()
    if row is None or row.kind != "find" or not row.result:
        return None
    with reading_row("job", job_id):
        result = FindResult.model_validate(row.result, **TOLERANTLY)
        if row.site is not None:
            return FoundSite(None, SoughtSite.model_validate(row.site, **TOLERANTLY), result)
        venue = stored_venue(row.venue_document)
        options = FindOptions.model_validate(row.options, **TOLERANTLY)
        return FoundSite(venue, SoughtSite.of(venue, options, row.frames), result)


def job_input_values(row: Any) -> dict[str, Any]:
    """Return the members of the `JobInput` of a job's row."""
    return {
        "job_id": row.id,
        "kind": row.kind,
        "venue": row.venue_document,
        "site": row.site,
        "options": row.options,
        "frames": row.frames,
        "origin": Origin(row.request_id, row.traceparent, row.asked_by, row.address),
    }


def _rows_of(connection: sa.Connection, wanted: JobPage, *columns: Any) -> tuple[Sequence[Any], str | None]:
    """Return the rows of a page, and the id that the next page is before; None: there is none."""
    rows = connection.execute(wanted.query(*columns)).all()
    return rows[: wanted.limit], rows[wanted.limit - 1].id if len(rows) > wanted.limit else None


def _summary(row: Any) -> JobSummary:
    with reading_row("job", row.id):
        return JobSummary.model_validate(dict(row._mapping), **TOLERANTLY)


def _jobs(connection: sa.Connection, rows: Sequence[Any]) -> tuple[list[Job], list[Unreadable]]:
    return read_each(rows, _reader(connection, rows))


def _reader(connection: sa.Connection, rows: Sequence[Any]) -> Callable[[Any], Job]:
    """Return what makes a job of one of these rows; what is known of them beside their rows is read of all at once."""
    positions = _positions(connection, [row.id for row in rows if row.status == "queued"])
    callbacks = deliveries_of(connection, [row.id for row in rows if row.finished_at and _calls_back(row.options)])
    taken = revisions_of_jobs(connection, [row.id for row in rows if row.kind in BRING_POSES and row.result])

    def read(row: Any) -> Job:
        with reading_row("job", row.id):
            values = _job_values(row, positions.get(row.id), callbacks.get(row.id), taken.get(row.id))
            return Job.model_validate(values, **TOLERANTLY)

    return read


def _calls_back(options: Any) -> bool:
    return isinstance(options, dict) and options.get("callback_url") is not None


def _job_values(row: Any, position: int | None, callback: CallbackState | None, revision: int | None) -> dict[str, Any]:
    columns = ("id", "kind", "venue", "status", "progress", "attempt", "error", "asked_by")
    moments = ("created_at", "started_at", "finished_at")
    return {name: getattr(row, name) for name in (*columns, *moments)} | {
        "queue_position": position,
        "result": row.result,
        "callback": callback,
        # An address may be a secret, and how far its telling has come is said by `callback`.
        "options": {name: value for name, value in row.options.items() if name != "callback_url"},
        "frames": _frames(row),
        "venue_revision": revision,
        "links": _links(row),
    }


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
    names = row.pictures or () if row.pictures_deleted_at is None else ()
    return links | {
        picture_address(name): f"{base}/{picture_address(name)}{PurePath(picture_file(name)).suffix}" for name in names
    }
