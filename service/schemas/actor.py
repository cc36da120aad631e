"""Who changed something, from where, and by which request."""

from __future__ import annotations

from typing import Self

from pydantic import Field

from service.schemas.base import Schema

# To whoever may not know which.
ANOTHER_KEY = "another key"
# Of what happens to a venue.
BY = "Who did it; null: the service by itself, or before 0.2.0."


class Actor(Schema):
    """Whoever made a change: what is told beside the change itself."""

    name: str = Field(
        description="`key NAME`: with this API key, on the page too; `schedule`: that of the venue; `anyone`: the "
        "service asks for no keys; `another key`: to a key for some venues, any but itself."
    )
    address: str | None = Field(
        description="IP address of the client, behind a trusted proxy the one that it names; null: there was none, or "
        "it is left out, as it is for webhooks."
    )
    request_id: str | None = Field(description="`X-Request-ID` of the request, by which its log lines are found.")

    def without_address(self) -> Actor:
        """Return the actor as receivers elsewhere are told it: the address of a client is personal data."""
        return self.model_copy(update={"address": None})


class Attributed(Schema):
    """An event with whoever made it happen."""

    by: Actor | None = Field(None, description=BY)

    def without_address(self) -> Self:
        """Return the event as receivers elsewhere are told it."""
        return self if self.by is None else self.model_copy(update={"by": self.by.without_address()})
