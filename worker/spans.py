"""OpenTelemetry spans of an attempt and its stages."""

from contextlib import ExitStack
from types import TracebackType
from typing import Self

from opentelemetry import trace
from opentelemetry.trace import Span, SpanKind, StatusCode

from service.observability import tracing
from service.store.jobs.task import Task
from worker.protocol import Message

# Before a job's program says how far it is: it starts, fetches and decodes the frames.
FIRST_STAGE = "start"


class Spans:
    """The spans of one attempt; they end with the `with` block."""

    def __init__(self, task: Task) -> None:
        self._tracer = trace.get_tracer("esc.worker")
        self._task = task
        self._open = ExitStack()
        self._stage: Span | None = None
        self._name = ""

    def __enter__(self) -> Self:
        of: dict[str, str | int] = {
            "esc.job": self._task.job_id,
            "esc.kind": self._task.kind,
            "esc.attempt": self._task.attempt,
        }
        if self._task.venue is not None:
            of["esc.venue"] = self._task.venue.id
        self._whole = self._open.enter_context(
            self._tracer.start_as_current_span(
                "job",
                tracing.context_of(self._task.origin.traceparent),
                kind=SpanKind.CONSUMER,
                attributes=of,
            )
        )
        self.at(FIRST_STAGE)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._stage is not None:
            self._stage.end()
        self._open.__exit__(kind, error, at)

    def at(self, stage: str) -> None:
        """Begin the span of a stage, unless the job is there already, and end that of the stage before."""
        if stage == self._name:
            return
        if self._stage is not None:
            self._stage.end()
        self._stage, self._name = self._tracer.start_span(stage), stage

    def end(self, last: Message | None) -> None:
        """Set the outcome of the attempt; None: its lease was lost."""
        if last is None:
            self._whole.set_attribute("esc.outcome", "taken away")
        elif last.error is not None:
            self._whole.set_attribute("esc.outcome", "failed")
            self._whole.set_attribute("error.type", last.error.type)
            self._whole.set_status(StatusCode.ERROR, last.error.detail)
        elif (verdict := last.verdict) is not None:
            # A lens has no verdict of its own.
            self._whole.set_attribute("esc.outcome", "succeeded" if verdict == "found" else verdict)
