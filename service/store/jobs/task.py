"""Input of a job. It travels as JSON to the program that computes it, which sees no database."""

import secrets
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, TypeVar, cast

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY
from service.schemas.check import CheckedFile
from service.schemas.find import SoughtSite
from service.schemas.names import JobKind
from service.schemas.options import FieldOptions, FindOptions, Handling, IntrinsicsOptions, LocateOptions, Options
from service.schemas.results import View
from service.schemas.trend import Anchor
from service.schemas.venue import Venue

# The name of the actor where no keys are required.
ANYONE = "anyone"
AnyOptions = Options | IntrinsicsOptions | LocateOptions | FieldOptions | FindOptions | CheckedFile
OPTIONS: dict[JobKind, type[AnyOptions]] = {
    "calibration": Options,
    "intrinsics": IntrinsicsOptions,
    "locate": LocateOptions,
    "field": FieldOptions,
    "find": FindOptions,
    "check": CheckedFile,
}


def stored_options(kind: str, document: Any) -> Handling:
    """The options of a stored job, those of a kind or with a field that only a newer version has as well."""
    return OPTIONS.get(cast(JobKind, kind), Handling).model_validate(document, **TOLERANTLY)


def kind_of(options: AnyOptions) -> JobKind:
    """Return the kind of job that has these options."""
    return next(kind for kind, model in OPTIONS.items() if type(options) is model)


def seeded(options: AnyOptions) -> AnyOptions:
    """The options with a seed where one can be chosen and was not, so that a job can be computed again alike."""
    if not isinstance(options, Options | FieldOptions | FindOptions | CheckedFile) or options.seed is not None:
        return options
    return options.model_copy(update={"seed": secrets.randbelow(2**31)})


# The actor of a job that a schedule submitted.
SCHEDULE = "schedule"


@dataclass(frozen=True)
class Origin:
    """The request that a job or another change came with: how the log calls it, its place in a trace (W3C Trace
    Context), who asked: `key NAME`, or `schedule`, and the client's address."""

    request_id: str | None = None
    traceparent: str | None = None
    asked_by: str | None = None
    address: str | None = None

    @property
    def actor(self) -> Actor | None:
        """The actor that history and events name for the change; None: nothing is known of one."""
        if self.request_id is None and self.asked_by is None:
            return None
        return Actor(name=self.asked_by or ANYONE, address=self.address, request_id=self.request_id)

    @property
    def is_schedule(self) -> bool:
        """True if the schedule of a venue submitted the job."""
        return self.asked_by == SCHEDULE

    def names(self) -> dict[str, str]:
        """Return the request and trace ids for the lines of the log."""
        trace = self.traceparent.split("-")[1] if self.traceparent else None
        return {name: value for name, value in (("request", self.request_id), ("trace", trace)) if value}


class JobInput(BaseModel):
    """The input of a job: venue snapshot, options, frames, origin.

    `options` are those of its kind; photos of a lens and checks have no venue, and `site` is one that is not stored
    yet, whose cameras are to be found. `frames`: the paths in the blob store by camera, of photos by their names.
    """

    model_config = ConfigDict(frozen=True)

    job_id: str
    kind: JobKind = "calibration"
    venue: Venue | None
    options: AnyOptions
    frames: dict[str, list[str]]
    origin: Origin = Origin()
    site: SoughtSite | None = None

    @property
    def venue_id(self) -> str | None:
        """The venue that the job is about, which need not be stored yet; None: photos of a lens and checks are about
        none."""
        about = self.venue or self.site
        return None if about is None else about.id

    @field_validator("options", mode="before")
    @classmethod
    def _are_of_the_kind(cls, options: Any, others: ValidationInfo) -> Any:
        # By their members alone, those of one kind could be those of another. Options are never read tolerantly here:
        # who does not know what was asked must not compute something else.
        if isinstance(options, dict) and "kind" in others.data:
            return OPTIONS[others.data["kind"]].model_validate(options)
        return options


class UnreadableJob(Exception):  # noqa: N818
    """A newer version wrote the job, with something in it that this version does not know; the message says what."""


Read = TypeVar("Read", bound=JobInput)


def parse_job_input(model: type[Read], values: dict[str, Any]) -> Read:
    """Validate the stored input of a job; raises `UnreadableJob`.

    Of its venue, fields that this version does not know are ignored. Options and words that it does not know are not.
    """
    try:
        return model.model_validate(values, extra="ignore")
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)[0]
        raise UnreadableJob(f"{'.'.join(map(str, found['loc']))}: {found['msg']}") from error


class Task(JobInput):
    """An attempt of a job: what a worker needs to compute it."""

    # A worker that lost its job holds another one than the row.
    run_token: str
    attempt: int = 1
    # By camera: what the frames of the venue's last accepted calibration were like.
    last_views: dict[str, View] = {}
    # By camera: what the engine keeps of its earlier nights.
    memories: dict[str, dict[str, Any]] = {}
    # The time of the frames, which counts as that of their upload: clients cannot say it yet.
    taken_at: datetime | None = None
    # By camera: the pose that its movement is counted from, of those that have one.
    anchors: dict[str, Anchor] = {}

    def without_addresses(self) -> "Task":
        """Return the task without who is told of it and where its client is: to compute it nobody need know."""
        untold = self.venue and self.venue.model_copy(update={"webhooks": [], "alarms": None})
        options = self.options.model_copy(update={"callback_url": None})
        origin = replace(self.origin, address=None)
        return self.model_copy(update={"venue": untold, "options": options, "origin": origin})
