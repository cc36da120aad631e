"""Models of API keys, as they are managed by HTTP."""

from datetime import datetime
from typing import Annotated

from pydantic import Field

from service.schemas.base import OPEN_WORD, Id, Schema, Timestamp
from service.schemas.names import Scope


class KeyIn(Schema):
    """An API key to be made."""

    name: Id = Field(description="Name of the key: of the machine or person that will use it.")
    scope: Scope = Field(description="`read`; `calibrate`, which includes it; `admin`, which includes both.")
    expires_at: Timestamp | None = Field(None, description="Time of its expiry; null: never.")
    venue_ids: Annotated[list[Id], Field(min_length=1)] | None = Field(
        None, description="Ids of the venues that it is for; null: all."
    )


class ApiKey(Schema):
    """An API key, without the key itself."""

    name: str = Field(description="Name of the key.")
    scope: Annotated[Scope, OPEN_WORD] = Field(description="Scope of the key.")
    created_at: datetime = Field(description="Time at which it was made.")
    expires_at: datetime | None = Field(description="Time of its expiry; null: never.")
    last_used_at: datetime | None = Field(description="Time of its last use, to the minute; null: never used.")
    venue_ids: list[str] | None = Field(description="Ids of the venues that it is for; null: all.")


class MadeKey(Schema):
    """An API key that was made; the only answer that has the key itself."""

    name: str = Field(description="Name of the key.")
    key: str = Field(description="The key, to be sent as `Authorization: Bearer ...`. It is not shown again.")


class ApiKeys(Schema):
    """All API keys of the service."""

    keys: list[ApiKey] = Field(description="Keys, by name.")
