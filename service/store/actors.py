"""Who made a change, as columns beside the change: `asked_by`, `address` and `request_id`."""

from __future__ import annotations

from typing import Any

from service.schemas.actor import Actor


def columns_of(by: Actor | None) -> dict[str, str | None]:
    """The columns of an actor; None: nobody, the service did it by itself."""
    if by is None:
        return {"asked_by": None, "address": None, "request_id": None}
    return {"asked_by": by.name, "address": by.address, "request_id": by.request_id}


def actor_in(row: Any) -> Actor | None:
    """The actor in the columns of a row; None: nobody, or the row is older than these columns."""
    if row.asked_by is None:
        return None
    return Actor(name=row.asked_by, address=row.address, request_id=row.request_id)
