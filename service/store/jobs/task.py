"""What a job is to compute. It travels as JSON to the program that computes it, which sees no database."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator

from service.wire.names import Kind
from service.wire.options import FieldOptions, IntrinsicsOptions, LocateOptions, Options
from service.wire.results import View
from service.wire.trend import Anchor
from service.wire.venue import Venue

AnyOptions = Options | IntrinsicsOptions | LocateOptions | FieldOptions
OPTIONS: dict[Kind, type[AnyOptions]] = {
    "calibration": Options,
    "intrinsics": IntrinsicsOptions,
    "locate": LocateOptions,
    "field": FieldOptions,
}


def kind_of(options: AnyOptions) -> Kind:
    """Which kind of job has such options."""
    return next(kind for kind, model in OPTIONS.items() if type(options) is model)


def seeded(options: AnyOptions) -> AnyOptions:
    """The options with a seed where one can be chosen and was not, so that a job can be computed again alike."""
    if not isinstance(options, Options | FieldOptions) or options.seed is not None:
        return options
    return options.model_copy(update={"seed": secrets.randbelow(2**31)})


@dataclass(frozen=True)
class Origin:
    """The request that a job came with: how the log calls it, its place in a trace (W3C Trace Context), and who asked:
    `key NAME`, or `schedule`."""

    request_id: str | None = None
    traceparent: str | None = None
    asked_by: str | None = None

    def names(self) -> dict[str, str]:
        """For every line of the log that comes of it."""
        trace = self.traceparent.split("-")[1] if self.traceparent else None
        return {name: value for name, value in (("request", self.request_id), ("trace", trace)) if value}


class Asked(BaseModel):
    """What is asked of a job. `options` are those of its kind; only photos of a lens have no venue.

    `frames`: the paths in the blob store by camera, of photos by their names.
    """

    model_config = ConfigDict(frozen=True)

    job_id: str
    kind: Kind = "calibration"
    venue: Venue | None
    options: AnyOptions
    frames: dict[str, list[str]]
    origin: Origin = Origin()

    @field_validator("options", mode="before")
    @classmethod
    def _are_of_the_kind(cls, options: Any, others: ValidationInfo) -> Any:
        # By their members alone, those of one kind could be those of another.
        return OPTIONS[others.data["kind"]].model_validate(options) if isinstance(options, dict) else options


class Task(Asked):
    """An attempt of a job: what a worker needs to compute it."""

    # A worker that lost its job holds another one than the row.
    run_token: str
    attempt: int = 1
    # By camera: what the frames of the venue's last accepted calibration were like.
    last_views: dict[str, View] = {}
    # By camera: what the engine keeps of its earlier nights.
    memories: dict[str, dict[str, Any]] = {}
    # When the frames were taken; nobody says so yet, and they are taken to be as old as their upload.
    taken_at: datetime | None = None
    # By camera: the pose that its movement is counted from, of those that have one.
    anchors: dict[str, Anchor] = {}

    def without_addresses(self) -> Task:
        """The same but for who is told of it: to compute it nobody need know, and the addresses may be secrets."""
        untold = self.venue and self.venue.model_copy(update={"webhooks": [], "alarms": None})
        return self.model_copy(
            update={"venue": untold, "options": self.options.model_copy(update={"callback_url": None})}
        )
