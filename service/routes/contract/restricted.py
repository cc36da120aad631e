"""Limits of keys for some venues: they may call routes about one of these, and lists, which leave out all others.

All other routes are closed to them, also those that are added later. A venue that the key is not for is answered with
404, whether it is stored or not: 403 would tell one customer the names of the others. A route about no venue is
answered with 403: the OpenAPI document shows to everybody that it exists.
"""

from typing import Annotated

from fastapi import Depends, Request
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool

from service.api.context import Context
from service.schemas.problems import Problem
from service.store.keys import Key
from service.store.refusals import no_such_job


async def _only_venues(request: Request) -> frozenset[str] | None:
    key: Key | None = getattr(request.state, "key", None)
    return None if key is None else key.venues


# The venues that the caller may know of; None: all. A route that takes them is a list, and leaves out all others.
OnlyVenues = Annotated[frozenset[str] | None, Depends(_only_venues)]


def is_list(route: APIRoute) -> bool:
    """True if a route lists venues, or what belongs to them, by `OnlyVenues`."""
    return any(dependency.call is _only_venues for dependency in route.dependant.dependencies)


async def check(request: Request, key: Key, *, lists: bool) -> None:
    """Raise a problem if a request is not about a venue of the caller's key; `lists`: the route is a list.

    It is the problem of a venue or job that does not exist.
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
            raise no_such_job(context.settings.keep_jobs_days)
    else:
        raise Problem(
            "key-for-some-venues",
            f"{key.name} is for {_names(key)}, and this is about no single venue. A key without --venue may call it.",
        )


def _names(key: Key) -> str:
    return ", ".join(sorted(key.venues or ()))
