"""Consistency of jobs, poses, queue and files while no job is open, read beside the service."""

import os
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import unquote, urlparse

import sqlalchemy as sa

from service.schemas.names import OPEN_STATUSES
from service.store import tables
from service.store.jobs.files import picture_folder
from testbed.homes import files
from testbed.running import Service, wait_for

POSED = ("id", "image_size", "intrinsics", "pose")


def settle(service: Service) -> None:
    """Wait until every job has ended and all that nobody will use is deleted; then everything must add up."""
    with service.database() as connection:
        # Uploads that never became jobs get an hour; all that could have become one here did.
        connection.execute(sa.update(tables.leftovers).values(due_at=datetime.now(UTC)))
    wait_for(lambda: not list(unsettled(service)), deadline_s=60)
    found = list(mistakes(service))
    assert not found, "\n".join(found)


def unsettled(service: Service) -> Iterator[str]:
    """Jobs and folders that still wait for something."""
    with service.database() as connection:
        yield from connection.scalars(sa.select(tables.jobs.c.id).where(tables.jobs.c.status.in_(OPEN_STATUSES)))
        yield from connection.scalars(sa.select(tables.leftovers.c.folder))
        yield from (job for job, status in queued(connection).items() if status in ("ENQUEUED", "PENDING"))


def mistakes(service: Service) -> Iterator[str]:
    """Inconsistencies in words."""
    with service.database() as connection:
        jobs = connection.execute(sa.select(tables.jobs)).all()
        revisions = connection.execute(sa.select(tables.revisions).order_by(tables.revisions.c.id)).all()
        venues = connection.execute(sa.select(tables.venues)).all()
        known_to_queue = set(queued(connection))
    moved = Counter(revision.job for revision in revisions if revision.cause == "calibrated")
    due = {job.id for job in jobs if job.result and job.result["accepted"] and not job.options["dry_run"]}
    ids = {job.id for job in jobs}
    yield from (f"job {job} moved its venue {count} times" for job, count in moved.items() if count > 1)
    # The history outlives the jobs, of which retention has deleted some.
    yield from (f"job {job} moved its venue" for job in (moved.keys() & ids) - due)
    yield from (f"job {job} did not move its venue" for job in due - moved.keys())
    last = {revision.venue: revision for revision in revisions}
    for venue in venues:
        stands = [{name: camera[name] for name in POSED} for camera in venue.document["cameras"]]
        for camera in last[venue.id].cameras:
            if camera not in stands:
                yield f"camera {camera['id']} of {venue.id} does not stand where the last revision has it"
    yield from (f"the queue knows {job}, which is no job" for job in known_to_queue - ids)
    yield from (f"the queue does not know {job}" for job in ids - known_to_queue)
    stored = set(files(service.blob_url))
    for job in jobs:
        named = {path for paths in job.frames.values() for path in paths if job.frames_deleted_at is None}
        if job.pictures_deleted_at is None:
            named |= {f"{picture_folder(job.id, job.run_token)}/{name}.jpg" for name in job.pictures or ()}
        yield from (f"{path} of job {job.id} is gone" for path in named - stored)
    for path in everything_in(service.blob_url):
        if path.split("/")[1] not in ids:
            yield f"{path} is nobody's"


def queued(connection: sa.Connection) -> dict[str, str]:
    """The jobs that the queue knows, and what it thinks of them."""
    schema = "dbos" if connection.dialect.name == "postgresql" else None
    table = sa.table("workflow_status", sa.column("workflow_uuid"), sa.column("status"), schema=schema)
    return {row.workflow_uuid: row.status for row in connection.execute(sa.select(table))}


def everything_in(blob_url: str) -> list[str]:
    """The paths of all files, of those too that the store does not list because nobody finished them."""
    parsed = urlparse(blob_url)
    if parsed.scheme != "file":
        return files(blob_url)
    root = unquote(parsed.path)
    # Folders may be deleted meanwhile, which this walk minds less than `Path.rglob`.
    return [os.path.relpath(Path(folder) / name, root) for folder, _, names in os.walk(root) for name in names]
