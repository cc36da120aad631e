"""Limits of streams of server-sent events: their number and duration."""

from collections.abc import AsyncIterator

from fastapi import Depends

from service.api.context import InContext

# Then the client connects again, with a key that must be good still.
LONGEST_S = 3600


async def _take_slot(context: InContext) -> AsyncIterator[None]:
    with context.followers.taken():
        yield


# Entry of `dependencies=`: the stream takes one of the service's slots for as long as it lasts.
FOLLOWER_SLOT = Depends(_take_slot)
