"""What a key for some venues may call: whatever is about one of them, and the lists, which leave out all others.

Anything else it may not, so that a route that is added is closed to such keys until somebody says how it is limited.
A venue that the key is not for is answered with 404, whether it is there or not: 403 would tell one customer the names
of the others, and who may not know of a venue cannot be told to ask for a larger scope. A route that is about no venue
is answered with 403: that it is there is in the document for all to read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Request
from starlette.concurrency import run_in_threadpool

from service.api.context import Context
from service.routes.contract.missing import no_such_job
from service.schemas.problems import Problem
from service.store.keys import Key

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])
LISTS = "lists_by_venue"


def lists_by_venue(endpoint: Endpoint) -> Endpoint:
    """Mark a route that is about all venues and leaves out those that `OnlyVenues` does not name."""
    setattr(endpoint, LISTS, True)
    return endpoint


def is_list(endpoint: Callable[..., Any]) -> bool:
    """Whether a route is marked so."""
    return getattr(endpoint, LISTS, False)


async def _only_venues(request: Request) -> frozenset[str] | None:
    key: Key | None = getattr(request.state, "key", None)
    return None if key is None else key.venues


# The venues that the caller may know of; None: all.
OnlyVenues = Annotated[frozenset[str] | None, Depends(_only_venues)]


async def check(request: Request, key: Key, *, lists: bool) -> None:
    """Refuse a request that is not about a venue of the caller's key. `lists`: the route leaves out what it is not for.

    Raises the problem that is answered where there is no such venue or job.
    """
    if key.venues is None or lists:
        return
    about = request.path_params
    if "venue_id" in about:
        if not key.is_for(about["venue_id"]):
            raise Problem("venue-not-found", f"{key.name} is for {_names(key)} and learns of no other venue.")
    elif "job_id" in about:
        context: Context = request.app.state.context
        if not key.is_for(await run_in_threadpool(context.jobs.venue_of, about["job_id"])):
            raise no_such_job(context.settings)
    else:
        raise Problem(
            "key-for-some-venues",
            f"{key.name} is for {_names(key)}, and this is about no single venue. A key without --venue may call it.",
        )


def _names(key: Key) -> str:
    return ", ".join(sorted(key.venues or ()))
