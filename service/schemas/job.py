"""A job: its state, how far it is, and what is told of its end."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, get_args

from pydantic import ConfigDict, Field, ValidationInfo, ValidatorFunctionWrapHandler, WrapValidator

from service.schemas.actor import Attributed
from service.schemas.base import OPEN_WORD, UNREADABLE, Schema, Unreadable, is_empty, is_none, is_tolerant
from service.schemas.names import OPEN_STATUSES, JobKind, JobStatus
from service.schemas.results import AnyResult


class Progress(Schema):
    """How far a running job has come: `fraction` 0..1 of the whole."""

    stage: Annotated[Literal["segmentation", "evolution", "refinement", "preview", "detection", "fit"], OPEN_WORD]
    fraction: float = Field(ge=0, le=1)
    generation: int | None = None
    loss: float | None = None
    expected_end: datetime | None = Field(
        None,
        exclude_if=is_none,
        description="Of a search for cameras: when it will end, estimated anew with each camera; else not there.",
    )


class JobError(Schema):
    """Why a job failed: the members of a problem (RFC 9457)."""

    type: str
    title: str
    detail: str
    camera: str | None = None


class CallbackState(Schema):
    """How far the telling of a job's end has come, once it has ended; `callback_url` in the options asked for it."""

    state: Annotated[Literal["waiting", "delivered", "given-up"], OPEN_WORD]
    attempts: int = Field(description="Begun so far.")
    last_error: str | None = Field(description="Why the last attempt that failed did.")
    next_attempt_at: datetime | None = Field(description="Null unless waiting.")


def _or_none_of_a_newer_kind(result: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """A result, unless the kind of the job is one that only a newer version knows."""
    newer = is_tolerant(info) and info.data.get("kind") not in get_args(JobKind)
    return None if newer else check(result)


class Job(Schema):
    """What a worker computes: its state, how far it is, and in the end its result, of its kind, or its error."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
                    "kind": "calibration",
                    "venue": "tsukuba",
                    "status": "running",
                    "progress": {"stage": "evolution", "fraction": 0.42, "generation": 37, "loss": 0.31},
                    "queue_position": None,
                    "attempt": 1,
                    "created_at": "2026-11-21T10:00:00Z",
                    "started_at": "2026-11-21T10:00:01Z",
                    "finished_at": None,
                    "error": None,
                    "result": None,
                    "callback": None,
                    "venue_revision": None,
                    "asked_by": "key truck-7",
                    "options": {"preset": "esc", "seed": 7},
                    "frames": {"left": ["/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/frames/0"]},
                    "links": {"self": "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"},
                }
            ]
        }
    )

    id: str
    kind: Annotated[JobKind, OPEN_WORD] = "calibration"
    venue: str | None = Field(
        description="Null for the intrinsics of a lens, which belong to no venue. That of a search for cameras need "
        "not be stored yet."
    )
    status: Annotated[JobStatus, OPEN_WORD]
    progress: Progress | None
    queue_position: int | None = Field(description="1 = next; null unless queued.")
    attempt: int = Field(description="How often the job was begun; above 1 after a crash of its worker.")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    error: JobError | None
    result: Annotated[AnyResult | None, WrapValidator(_or_none_of_a_newer_kind)]
    callback: CallbackState | None = Field(
        None, description="Null before the end, without `callback_url`, and in what a `callback_url` gets."
    )
    venue_revision: int | None = Field(
        None, description="The revision of the venue that its poses became, by themselves or by hand; null: none."
    )
    asked_by: str | None = Field(
        None,
        description="`key NAME`: with this API key; `schedule`: that of the venue; `another key`: to a key for some "
        "venues, any but itself; null: no key was asked for.",
    )
    options: dict[str, Any] = Field(
        {}, description="As they were asked, what was left out filled in, the seed too; without `callback_url`."
    )
    frames: dict[str, list[str]] = Field(
        {}, description="Addresses of the frames as they came, by camera or the name of a photo; empty: none are kept."
    )
    links: dict[str, str] = Field(description="Addresses, relative to that of the service.")

    @property
    def open(self) -> bool:
        """Whether anything can still change."""
        return self.status in OPEN_STATUSES


class JobEvent(Attributed):
    """A job has ended: what a `callback_url` gets, at least once; its id is the `webhook-id` of every attempt.

    Who follows the venue is also told when a job was submitted (`job.queued`).
    """

    type: Literal["job.queued", "job.succeeded", "job.failed", "job.cancelled"]
    timestamp: datetime = Field(description="When it happened.")
    data: Job = Field(description="As it ended; of `job.queued`: as it was when it was submitted.")

    @classmethod
    def of(cls, job: Job) -> JobEvent:
        """The event of an ended job."""
        told = job.model_copy(update={"callback": None})
        return cls.model_validate({"type": f"job.{job.status}", "timestamp": job.finished_at, "data": told})


class JobSummary(Schema):
    """A job in a line: how it ended or how far it is, without its result."""

    id: str
    kind: Annotated[JobKind, OPEN_WORD]
    venue: str | None
    status: Annotated[JobStatus, OPEN_WORD]
    progress: Progress | None
    attempt: int
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    error: JobError | None
    verdict: str | None = Field(description="Of the result of a calibration.")
    stitch_error_px: float | None = Field(description="Of the result of a calibration.")
    asked_by: str | None


class Jobs(Schema):
    """A page of jobs, newest first. `next_cursor`: null on the last page."""

    jobs: list[Job]
    summaries: list[JobSummary] | None = Field(
        None, exclude_if=is_none, description="With `fields=summary`, where `jobs` is empty; not there otherwise."
    )
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: str | None = None
