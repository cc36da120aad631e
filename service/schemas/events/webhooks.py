"""Webhooks of a venue. Apart from the events: a venue has webhooks, and events have venues."""

from typing import Annotated, Any

from pydantic import Field

from service.schemas.addresses import CallbackUrl
from service.schemas.base import OPEN_WORD, Schema, with_example
from service.schemas.names import EVENT_KINDS, EventKind

WEBHOOK_EXAMPLE: dict[str, Any] = {"url": "https://example.com/poses", "events": ["poses.changed"]}


class Webhook(Schema):
    """URL that gets events of a venue as signed POSTs (Standard Webhooks), with retries for a day."""

    model_config = with_example(**WEBHOOK_EXAMPLE)

    url: CallbackUrl = Field(description="Address that gets the events; answers show it without its path.")
    events: Annotated[list[Annotated[EventKind, OPEN_WORD]], Field(min_length=1, max_length=len(EVENT_KINDS))] = Field(
        ["poses.changed"], description="Kinds of events that it gets."
    )
