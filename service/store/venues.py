"""Venues and the history of their poses: all SQL about them."""

from __future__ import annotations

from collections.abc import Callable

import sqlalchemy as sa

from service.schemas import HeldPose, Pose, Venue
from service.store import tables
from service.store.engine import clock, reading, serialise, writing
from service.store.figures import forget_quality


class Venues:
    """The venues in the database."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def get(self, venue_id: str) -> Venue | None:
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

    def put(self, venue: Venue, allow: Callable[[Venue | None], None]) -> bool:
        """Store a venue unless `allow` raises at the sight of what is there; says whether it is new."""
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue.id))
            before = find_venue(connection, venue.id)
            allow(before)
            known = before.poses if before else {}
            moved = {camera: pose for camera, pose in venue.poses.items() if known.get(camera) != pose}
            save_venue(connection, venue)
            save_poses(connection, venue.id, moved, "put")
            return before is None

    def delete(self, venue_id: str, allow: Callable[[Venue | None, str | None], None]) -> None:
        """Forget a venue and its poses unless `allow` raises at the sight of it or of its active job."""
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue_id))
            active = connection.scalar(
                sa.select(tables.jobs.c.id).where(
                    tables.jobs.c.venue == venue_id, tables.jobs.c.status.in_(["queued", "running"])
                )
            )
            allow(find_venue(connection, venue_id), active)
            connection.execute(sa.delete(tables.pose_history).where(tables.pose_history.c.venue == venue_id))
            forget_quality(connection, venue_id)
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


def venue_lock(venue_id: str) -> str:
    """What to be serialised about by whoever changes a venue, or relies on it to stay."""
    return f"venue {venue_id}"


def find_venue(connection: sa.Connection, venue_id: str) -> Venue | None:
    """One venue, inside the caller's transaction."""
    document = connection.scalar(sa.select(tables.venues.c.document).where(tables.venues.c.id == venue_id))
    return None if document is None else Venue.model_validate(document)


def save_venue(connection: sa.Connection, venue: Venue) -> None:
    """Create or replace a venue, inside the caller's serialised transaction."""
    values = {"document": venue.model_dump(mode="json"), "updated_at": clock(connection)}
    table = tables.venues
    replaced = connection.execute(sa.update(table).where(table.c.id == venue.id).values(**values))
    if replaced.rowcount == 0:
        connection.execute(sa.insert(table).values(id=venue.id, **values))


def save_poses(
    connection: sa.Connection, venue_id: str, poses: dict[str, Pose], cause: str, job: str | None = None
) -> None:
    """Add poses that hold from now on to the history, inside the caller's transaction."""
    now = clock(connection)
    rows = [
        {"venue": venue_id, "camera": camera, "pose": pose.model_dump(), "cause": cause, "job": job, "since": now}
        for camera, pose in poses.items()
    ]
    if rows:
        connection.execute(sa.insert(tables.pose_history), rows)
