"""Models of a job: state, progress, result, and the event of its end."""

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Field, ValidationInfo, ValidatorFunctionWrapHandler, WrapValidator

from service.schemas.actor import Attributed
from service.schemas.base import OPEN_WORD, UNREADABLE, Schema, Unreadable, is_empty, is_none, is_tolerant, with_example
from service.schemas.names import OPEN_STATUSES, JobKind, JobStatus, problem_uri
from service.schemas.problems import PROBLEM_TYPES
from service.schemas.results import AnyResult


class Progress(Schema):
    """Progress of a running job."""

    stage: Annotated[Literal["segmentation", "evolution", "refinement", "preview", "detection", "fit"], OPEN_WORD] = (
        Field(description="Stage that is being computed.")
    )
    fraction: float = Field(ge=0, le=1, description="Progress 0..1 of the whole job.")
    generation: int | None = Field(None, description="Generation of the search.")
    loss: float | None = Field(None, description="Loss of the best candidate so far.")
    expected_end: datetime | None = Field(
        None,
        exclude_if=is_none,
        description="Estimated end of a search for cameras, updated with each camera; absent for other jobs.",
    )


class JobError(Schema):
    """Reason of a failed job, with the members of a problem (RFC 9457)."""

    type: str = Field(description="Type of the problem: an address that explains it.")
    title: str = Field(description="The type in words.")
    detail: str = Field(description="Reason, and what to do.")
    camera: str | None = Field(None, description="Id of the camera that it is about, if it is one.")

    @classmethod
    def of(cls, kind: str, detail: str, camera: str | None = None) -> Self:
        """Return the error of a kind of `PROBLEM_TYPES`."""
        return cls(type=problem_uri(kind), title=PROBLEM_TYPES[kind].title, detail=detail, camera=camera)


class CallbackState(Schema):
    """Delivery of the callback of an ended job to the `callback_url` of its options."""

    state: Annotated[Literal["waiting", "delivered", "given-up"], OPEN_WORD] = Field(
        description="`waiting` for the next attempt, `delivered`, or `given-up` after the last."
    )
    attempts: int = Field(description="Attempts begun so far.")
    last_error: str | None = Field(description="Reason of the last failed attempt.")
    next_attempt_at: datetime | None = Field(description="Time of the next attempt; null unless waiting.")


def _read_result(result: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """Return the result, or None for a kind of job that only a newer version knows."""
    kind = info.data.get("kind")
    if is_tolerant(info) and kind not in get_args(JobKind):
        return None
    # Earlier releases stored results without their kind.
    return check({"kind": kind} | result if isinstance(result, dict) else result)


class JobBase(Schema):
    """State and progress of a job, without its result."""

    id: str = Field(description="Id of the job.")
    kind: Annotated[JobKind, OPEN_WORD] = Field(
        "calibration", description="Kind of computation, which decides what `result` has."
    )
    venue: str | None = Field(
        description="Id of the venue; null for the intrinsics of a lens. For a search for cameras, the venue need not "
        "be stored yet."
    )
    status: Annotated[JobStatus, OPEN_WORD] = Field(description="State of the job; the last three are final.")
    progress: Progress | None
    attempt: int = Field(description="Number of starts of the job; above 1 after a crash of its worker.")
    created_at: datetime = Field(description="Time of its submission.")
    started_at: datetime | None = Field(description="Time of its first start; null while queued.")
    finished_at: datetime | None = Field(description="Time of its end; null while open.")
    error: JobError | None
    asked_by: str | None = Field(
        None,
        description="Submitter. `key NAME`: this API key; `schedule`: the venue's schedule; `another key`: shown to a "
        "key that is limited to some venues, for any key but itself; null: the service asked for no key.",
    )


class Job(JobBase):
    """A computation of a worker: its state, its progress, and in the end its result or its error."""

    model_config = with_example(
        id="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
        kind="calibration",
        venue="tsukuba",
        status="running",
        progress={"stage": "evolution", "fraction": 0.42, "generation": 37, "loss": 0.31},
        queue_position=None,
        attempt=1,
        created_at="2026-11-21T10:00:00Z",
        started_at="2026-11-21T10:00:01Z",
        finished_at=None,
        error=None,
        result=None,
        callback=None,
        venue_revision=None,
        asked_by="key truck-7",
        options={"preset": "esc", "seed": 7},
        frames={"left": ["/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D/frames/0"]},
        links={"self": "/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"},
    )

    queue_position: int | None = Field(description="Position in the queue, 1 = next; null unless queued.")
    result: Annotated[AnyResult | None, WrapValidator(_read_result)] = Field(
        description="Result, by the kind of job; null before its end, and of a job that failed or was cancelled."
    )
    callback: CallbackState | None = Field(
        None, description="Delivery of the callback; null before the end, without `callback_url`, and in callbacks."
    )
    venue_revision: int | None = Field(
        None, description="Revision of the venue that its poses became, automatically or by hand; null: none."
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


def newest_failed(jobs: Iterable[Job]) -> list[str]:
    """Return the ids of failed jobs to run again, of `jobs`, newest first: of each venue the newest with frames.

    Older frames of a venue are out of date, and a venue has one active job.
    """
    newest: dict[str, str] = {}
    for job in jobs:
        if job.status == "failed" and job.frames:
            newest.setdefault(job.venue or job.id, job.id)
    return list(newest.values())


class JobEvent(Attributed):
    """Event of an ended job, sent to its `callback_url` at least once; the `webhook-id` of every attempt is the same.

    Webhooks and event streams of the venue also get `job.queued`, when a job is submitted.
    """

    type: Literal["job.queued", "job.succeeded", "job.failed", "job.cancelled"] = Field(
        description="`job.` and the status."
    )
    timestamp: datetime = Field(description="Time of the event.")
    data: Job = Field(description="The job at its end; for `job.queued`, at its submission.")

    @classmethod
    def of(cls, job: Job) -> "JobEvent":
        """Return the event of an ended job."""
        data = job.model_copy(update={"callback": None})
        return cls.model_validate({"type": f"job.{job.status}", "timestamp": job.finished_at, "data": data})


class JobSummary(JobBase):
    """Summary of a job: state and progress, without its result."""

    verdict: str | None = Field(description="Verdict of a calibration's result.")
    stitch_error_px: float | None = Field(description="Stitch error of a calibration's result.")


class Jobs(Schema):
    """A page of jobs."""

    jobs: list[Job] = Field(description="Jobs, newest first.")
    summaries: list[JobSummary] | None = Field(
        None, exclude_if=is_none, description="Only with `fields=summary`, and then instead of `jobs`."
    )
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: str | None = Field(None, description="`cursor` of the next page; null on the last.")
