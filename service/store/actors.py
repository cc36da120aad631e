"""Actors of changes as columns of a row: `asked_by`, `address` and `request_id`."""

from typing import Any

from service.schemas.actor import Actor


def columns_of(by: Actor | None) -> dict[str, str | None]:
    """Return the columns of an actor, or of None where the service acted by itself."""
    if by is None:
        return {"asked_by": None, "address": None, "request_id": None}
    return {"asked_by": by.name, "address": by.address, "request_id": by.request_id}


def actor_in(row: Any) -> Actor | None:
    """Return the actor in the columns of a row, or None where the service acted by itself."""
    if row.asked_by is None:
        return None
    return Actor(name=row.asked_by, address=row.address, request_id=row.request_id)
