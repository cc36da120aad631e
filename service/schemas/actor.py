"""The author of a change: name, address and request."""

from typing import Self

from pydantic import Field

from service.schemas.base import Schema

# Shown in place of the name to keys that may not see it.
ANOTHER_KEY = "another key"
BY = "Author of the change; null: the service itself, or a version before 0.2.0."


class Actor(Schema):
    """Author of a change: the API key or schedule, its address and the request."""

    name: str = Field(
        description="`key NAME`: this API key, also on the page; `schedule`: the venue's schedule; `anyone`: the "
        "service asks for no keys; `another key`: shown to a key that is limited to some venues, for any key but "
        "itself."
    )
    address: str | None = Field(
        description="IP address of the client, as a trusted proxy reports it; null: none is known. Left out of "
        "webhooks."
    )
    request_id: str | None = Field(description="`X-Request-ID` of the request; its log lines carry it too.")

    def without_address(self) -> "Actor":
        """Return the actor without the client's address, for receivers outside: an address is personal data."""
        return self.model_copy(update={"address": None})


class Attributed(Schema):
    """An event and the author of the change that it reports."""

    by: Actor | None = Field(None, description=BY)

    def without_address(self) -> Self:
        """Return the event without the author's address, for receivers outside."""
        return self if self.by is None else self.model_copy(update={"by": self.by.without_address()})
