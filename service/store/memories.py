"""The memories of the cameras of venues: what earlier nights measured, kept beside the revisions. All SQL about them.

The engine writes and reads a memory; to the service it is a JSON object. The memories of a venue are one document,
camera id to memory, and a row belongs to the revision with which the document came, so that undoing a revision takes
its nights back too. A venue without a row has no memories yet.
"""

import json
from collections.abc import Mapping
from functools import partial
from typing import Any

import sqlalchemy as sa
import structlog
from pydantic import TypeAdapter

from service.schemas.venue import Venue
from service.store import tables
from service.store.unreadable import read_or

# A memory as the engine has written it; and those of a venue, by camera.
Memory = dict[str, Any]
Memories = Mapping[str, Memory]
# Documents of a venue that are kept, the newest: a few revisions can be undone with the nights that they had.
KEPT = 4
# As JSON. 32 cameras that remember as much as they can have this; what is larger is not what the engine writes.
LARGEST_BYTES = 8 * 1024 * 1024
MEMORIES: TypeAdapter[Memories] = TypeAdapter(dict[str, Memory])
m = tables.memories.c
log = structlog.get_logger()


def newest_memories(connection: sa.Connection, venue_id: str) -> Memories:
    """Return the memories in use, {} if there are none."""
    query = sa.select(m.document).where(m.venue == venue_id).order_by(m.revision.desc()).limit(1)
    return _memories_in(venue_id, connection.scalar(query))


def memories_at(connection: sa.Connection, venue_id: str, revision: int) -> Memories:
    """Return the memories that came with a revision, {} if none did or they have expired."""
    query = sa.select(m.document).where(m.venue == venue_id, m.revision == revision)
    return _memories_in(venue_id, connection.scalar(query))


def revisions_with_memories(connection: sa.Connection, venue_id: str) -> set[int]:
    """Return the revisions of a venue whose memories are kept."""
    return set(connection.scalars(sa.select(m.revision).where(m.venue == venue_id)))


def keep_memories(connection: sa.Connection, venue_id: str, revision: int, memories: Memories) -> None:
    """Store the memories of a new revision of a venue, inside the caller's serialised transaction."""
    kept = _unless_too_large(venue_id, memories)
    if not kept and not newest_memories(connection, venue_id):
        return
    connection.execute(sa.insert(tables.memories).values(venue=venue_id, revision=revision, document=kept))
    numbers = sa.select(m.revision).where(m.venue == venue_id).order_by(m.revision.desc()).limit(KEPT)
    connection.execute(sa.delete(tables.memories).where(m.venue == venue_id, m.revision.not_in(numbers)))


def forget_memories(connection: sa.Connection, venue_id: str) -> None:
    """Drop all memories of a venue, those of its earlier revisions too, inside the caller's serialised transaction."""
    connection.execute(sa.delete(tables.memories).where(m.venue == venue_id))


def without_those_that_changed(memories: Memories, before: Venue, after: Venue) -> Memories:
    """Return the memories of the cameras whose pose and lens are the same in both venues."""
    stood = {camera.id: camera for camera in before.poses_and_lenses}
    same = {camera.id for camera in after.poses_and_lenses if stood.get(camera.id) == camera}
    return {camera: memory for camera, memory in memories.items() if camera in same}


def _memories_in(venue_id: str, document: Any) -> Memories:
    """Return the memories of a column, {} where it has none or cannot be read: they begin anew."""
    return read_or({}, "memory", venue_id, partial(MEMORIES.validate_python, document or {}))


def _unless_too_large(venue_id: str, memories: Memories) -> Memories:
    size = len(json.dumps(memories).encode())
    if size <= LARGEST_BYTES:
        return memories
    log.warning("memories too large, dropped", venue=venue_id, bytes=size, most=LARGEST_BYTES)
    return {}
