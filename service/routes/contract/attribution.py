"""Who made a change, as far as the caller may know: a key for some venues learns of no other key, nor of its address.

The owner of a venue sees that somebody else changed it, and asks whoever runs the service, whose keys name everybody.
"""

from __future__ import annotations

from contextvars import ContextVar
from typing import TypeVar

from service.schemas.actor import ANOTHER_KEY, Actor, Attributed
from service.schemas.history import Revision
from service.schemas.job import Job, JobEvent, JobSummary
from service.store.keys import Key

Told = TypeVar("Told", Revision, Attributed)
Asked = TypeVar("Asked", Job, JobSummary)
# Of the request that is being answered; None: no key was asked for.
caller_key: ContextVar[Key | None] = ContextVar("caller_key", default=None)


def hide_other_actor(told: Told) -> Told:
    """Return a revision or an event without what its caller may not know of whoever made it."""
    hidden = told if told.by is None else told.model_copy(update={"by": _visible(told.by)})
    return hidden.model_copy(update={"data": hide_other_asker(hidden.data)}) if isinstance(hidden, JobEvent) else hidden


def hide_other_asker(job: Asked) -> Asked:
    """Return a job without what its caller may not know of whoever asked for it."""
    return job.model_copy(update={"asked_by": ANOTHER_KEY}) if _is_hidden(job.asked_by) else job


def _visible(by: Actor) -> Actor:
    return Actor(name=ANOTHER_KEY, address=None, request_id=None) if _is_hidden(by.name) else by


def _is_hidden(name: str | None) -> bool:
    """Return True for a key that is not the caller's own; who is no key (`schedule`, `anyone`) is no secret."""
    key = caller_key.get()
    is_key = name is not None and name.startswith("key ")
    return is_key and key is not None and key.venues is not None and name != f"key {key.name}"
