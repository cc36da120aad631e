"""Models of a job: state, progress, result, and the event of its end."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema
from pydantic_core.core_schema import with_info_wrap_validator_function

from service.schemas.actor import Attributed
from service.schemas.base import OPEN_WORD, UNREADABLE, Schema, Unreadable, is_empty, is_none, is_tolerant
from service.schemas.names import OPEN_STATUSES, JobKind, JobStatus
from service.schemas.results import KIND, AnyResult


class Progress(Schema):
    """Progress of a running job; `fraction`: 0..1 of the whole job."""

    stage: Annotated[Literal["segmentation", "evolution", "refinement", "preview", "detection", "fit"], OPEN_WORD]
    fraction: float = Field(ge=0, le=1)
    generation: int | None = None
    loss: float | None = None
    expected_end: datetime | None = Field(
        None,
        exclude_if=is_none,
        description="Estimated end of a search for cameras, updated with each camera; absent for other jobs.",
    )


class JobError(Schema):
    """Reason of a failed job, with the members of a problem (RFC 9457)."""

    type: str
    title: str
    detail: str
    camera: str | None = None


class CallbackState(Schema):
    """Delivery of the callback of an ended job to the `callback_url` of its options."""

    state: Annotated[Literal["waiting", "delivered", "given-up"], OPEN_WORD]
    attempts: int = Field(description="Attempts begun so far.")
    last_error: str | None = Field(description="Reason of the last failed attempt.")
    next_attempt_at: datetime | None = Field(description="Time of the next attempt; null unless waiting.")


class _ResultOfAnyKind:
    """Annotation of a result: None for a kind of job that only a newer version knows.

    Earlier releases stored results without their kind.
    """

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return with_info_wrap_validator_function(self._read, handler(source))

    def _read(self, result: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        kind = info.data.get("kind")
        if is_tolerant(info) and kind not in get_args(JobKind):
            return None
        return check({"kind": kind} | result if isinstance(result, dict) else result)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        made = handler(schema)
        if handler.mode == "serialization":
            known, nothing = made["anyOf"]
            made = {**made, "anyOf": [known, OTHER_RESULT, nothing]}
        return made


OTHER_RESULT = {
    "title": "OtherResult",
    "description": "Result of a kind of job that later versions add.",
    "type": "object",
    "properties": {"kind": {"type": "string", "description": KIND}},
    "required": ["kind"],
}


class Job(Schema):
    """A computation of a worker: its state, its progress, and in the end its result or its error."""

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
        description="Id of the venue; null for the intrinsics of a lens. For a search for cameras, the venue need not "
        "be stored yet."
    )
    status: Annotated[JobStatus, OPEN_WORD]
    progress: Progress | None
    queue_position: int | None = Field(description="Position in the queue, 1 = next; null unless queued.")
    attempt: int = Field(description="Number of starts of the job; above 1 after a crash of its worker.")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    error: JobError | None
    result: Annotated[AnyResult | None, _ResultOfAnyKind()] = Field(
        description="Result, by the kind of job; null before its end, and of a job that failed or was cancelled."
    )
    callback: CallbackState | None = Field(
        None, description="Delivery of the callback; null before the end, without `callback_url`, and in callbacks."
    )
    venue_revision: int | None = Field(
        None, description="Revision of the venue that its poses became, automatically or by hand; null: none."
    )
    asked_by: str | None = Field(
        None,
        description="Submitter. `key NAME`: this API key; `schedule`: the venue's schedule; `another key`: shown to a "
        "key that is limited to some venues, for any key but itself; null: the service asked for no key.",
    )
    options: dict[str, Any] = Field(
        {}, description="Options of the job with all defaults and the seed filled in, without `callback_url`."
    )
    frames: dict[str, list[str]] = Field(
        {}, description="Addresses of the frames as uploaded, by camera or photo name; empty: no longer kept."
    )
    links: dict[str, str] = Field(description="Related addresses, relative to the service's.")

    @property
    def open(self) -> bool:
        """True while the job is queued or running."""
        return self.status in OPEN_STATUSES


class JobEvent(Attributed):
    """Event of an ended job, sent to its `callback_url` at least once; the `webhook-id` of every attempt is the same.

    Webhooks and event streams of the venue also get `job.queued`, when a job is submitted.
    """

    type: Literal["job.queued", "job.succeeded", "job.failed", "job.cancelled"]
    timestamp: datetime = Field(description="Time of the event.")
    data: Job = Field(description="The job at its end; for `job.queued`, at its submission.")

    @classmethod
    def of(cls, job: Job) -> JobEvent:
        """Return the event of an ended job."""
        data = job.model_copy(update={"callback": None})
        return cls.model_validate({"type": f"job.{job.status}", "timestamp": job.finished_at, "data": data})


class JobSummary(Schema):
    """Summary of a job: state and progress, without its result."""

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
    verdict: str | None = Field(description="Verdict of a calibration's result.")
    stitch_error_px: float | None = Field(description="Stitch error of a calibration's result.")
    asked_by: str | None


class Jobs(Schema):
    """A page of jobs, newest first. `next_cursor`: null on the last page."""

    jobs: list[Job]
    summaries: list[JobSummary] | None = Field(
        None, exclude_if=is_none, description="Only with `fields=summary`, and then instead of `jobs`."
    )
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: str | None = None
