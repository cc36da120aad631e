"""Venues and the history of their poses: all SQL about them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import sqlalchemy as sa

from service.schemas import HeldPose, Pose, Venue
from service.store import tables
from service.store.engine import reading, serialise, writing


@dataclass(frozen=True)
class StoredVenue:
    """A venue and the count of its changes."""

    venue: Venue
    revision: int


class Venues:
    """The venues in the database."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def get(self, venue_id: str) -> StoredVenue | None:
        """One venue."""
        with reading(self._engine) as connection:
            return find_venue(connection, venue_id)

    def page(self, after: str | None, limit: int) -> list[Venue]:
        """Up to `limit` venues by id, those after `after`."""
        query = sa.select(tables.venues.c.document).order_by(tables.venues.c.id).limit(limit)
        if after is not None:
            query = query.where(tables.venues.c.id > after)
        with reading(self._engine) as connection:
            return [Venue.model_validate(document) for document in connection.scalars(query)]

    def put(self, venue: Venue, allow: Callable[[StoredVenue | None], None]) -> tuple[StoredVenue, bool]:
        """Store a venue unless `allow` raises at the sight of what is there; also says whether it is new."""
        with writing(self._engine) as connection:
            serialise(connection)
            before = find_venue(connection, venue.id)
            allow(before)
            if before is not None and before.venue == venue:
                return before, False
            poses = {camera.id: camera.pose for camera in venue.cameras}
            stored = StoredVenue(venue, before.revision + 1 if before else 1)
            known = {camera.id: camera.pose for camera in before.venue.cameras} if before else {}
            save_venue(connection, stored)
            save_poses(connection, venue.id, {c: pose for c, pose in poses.items() if known.get(c) != pose}, "put")
            return stored, before is None

    def delete(self, venue_id: str, allow: Callable[[StoredVenue | None, str | None], None]) -> None:
        """Forget a venue and its poses unless `allow` raises at the sight of it or of its active job."""
        with writing(self._engine) as connection:
            serialise(connection)
            active = connection.scalar(
                sa.select(tables.jobs.c.id).where(
                    tables.jobs.c.venue == venue_id, tables.jobs.c.status.in_(["queued", "running"])
                )
            )
            allow(find_venue(connection, venue_id), active)
            connection.execute(sa.delete(tables.pose_history).where(tables.pose_history.c.venue == venue_id))
            connection.execute(sa.delete(tables.venues).where(tables.venues.c.id == venue_id))

    def poses(self, venue_id: str, before: int | None, limit: int) -> list[tuple[int, HeldPose]]:
        """Up to `limit` poses that held, newest first, those older than number `before`, with their numbers."""
        h = tables.pose_history.c
        query = sa.select(tables.pose_history).where(h.venue == venue_id).order_by(h.id.desc()).limit(limit)
        if before is not None:
            query = query.where(h.id < before)
        with reading(self._engine) as connection:
            return [
                (row.id, HeldPose(camera=row.camera, pose=row.pose, cause=row.cause, job=row.job, since=row.since))
                for row in connection.execute(query)
            ]


def find_venue(connection: sa.Connection, venue_id: str) -> StoredVenue | None:
    """One venue, inside the caller's transaction."""
    query = sa.select(tables.venues.c.document, tables.venues.c.revision).where(tables.venues.c.id == venue_id)
    row = connection.execute(query).one_or_none()
    return None if row is None else StoredVenue(Venue.model_validate(row.document), row.revision)


def save_venue(connection: sa.Connection, stored: StoredVenue) -> None:
    """Write a venue of a new revision, inside the caller's transaction."""
    values = {
        "document": stored.venue.model_dump(mode="json"),
        "revision": stored.revision,
        "updated_at": datetime.now(UTC),
    }
    table = tables.venues
    if stored.revision == 1:
        connection.execute(sa.insert(table).values(id=stored.venue.id, **values))
    else:
        connection.execute(sa.update(table).where(table.c.id == stored.venue.id).values(**values))


def save_poses(
    connection: sa.Connection, venue_id: str, poses: dict[str, Pose], cause: str, job: str | None = None
) -> None:
    """Add poses that hold from now on to the history, inside the caller's transaction."""
    now = datetime.now(UTC)
    rows = [
        {"venue": venue_id, "camera": camera, "pose": pose.model_dump(), "cause": cause, "job": job, "since": now}
        for camera, pose in poses.items()
    ]
    if rows:
        connection.execute(sa.insert(tables.pose_history), rows)
