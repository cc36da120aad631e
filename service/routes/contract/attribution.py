"""Attribution of changes, as far as the caller may know: a key for some venues learns neither names nor addresses of
other keys.

The owner of a venue sees that somebody else changed it, and can ask the operator, whose keys name everybody.
"""

from contextvars import ContextVar
from typing import TypeVar

from service.schemas.actor import ANOTHER_KEY, Actor, Attributed
from service.schemas.history import Revision
from service.schemas.job import Job, JobEvent, JobSummary
from service.store.keys import Key

Recorded = TypeVar("Recorded", Revision, Attributed)
Asked = TypeVar("Asked", Job, JobSummary)
# Key of the request that is being answered; None: the service asks for none.
caller_key: ContextVar[Key | None] = ContextVar("caller_key", default=None)


def hide_other_actor(recorded: Recorded) -> Recorded:
    """Return a revision or an event without the name of its author, if the caller may not know it."""
    hidden = recorded if recorded.by is None else recorded.model_copy(update={"by": _visible(recorded.by)})
    return hidden.model_copy(update={"data": hide_other_asker(hidden.data)}) if isinstance(hidden, JobEvent) else hidden


def hide_other_asker(job: Asked) -> Asked:
    """Return a job without the name of the key that submitted it, if the caller may not know it."""
    return job.model_copy(update={"asked_by": ANOTHER_KEY}) if _is_hidden(job.asked_by) else job


def _visible(by: Actor) -> Actor:
    return Actor(name=ANOTHER_KEY, address=None, request_id=None) if _is_hidden(by.name) else by


def _is_hidden(name: str | None) -> bool:
    """True for the key of another caller; names that are no keys (`schedule`, `anyone`) are no secret."""
    key = caller_key.get()
    is_key = name is not None and name.startswith("key ")
    return is_key and key is not None and key.venues is not None and name != f"key {key.name}"
