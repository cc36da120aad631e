"""Outcomes of jobs, and their increments of the counters."""

from dataclasses import dataclass
from datetime import datetime
from typing import get_args

from service.schemas.job import JobError
from service.schemas.names import JobKind, JobStatus, problem_uri
from service.schemas.problems import PROBLEM_TYPES
from service.schemas.results import AnyResult, Cause, Result
from service.store.statistics.counters import DURATION, STAGE, STITCH_ERROR, WAIT, Increments, total

# As in `timings_s` of a result.
STAGES = ("decode", "view", "segmentation", "evolution", "refinement", "quality", "preview")
# Errors that can end a job; any other that a job program may report counts as `other`.
ERRORS = (
    "broken-image",
    "frame-size",
    "no-markings-in-view",
    "source-failed",
    "model-missing",
    "provider-missing",
    "job-timeout",
    "job-crashed",
    "job-abandoned",
    "other",
)
# Status, verdict of the gate, kind of the error: every way to end.
OUTCOMES = (
    ("succeeded", "accepted", ""),
    ("succeeded", "partly", ""),
    ("succeeded", "rejected", ""),
    ("cancelled", "", ""),
    *(("failed", "", error) for error in ERRORS),
)
ENDED = "jobs_ended"
# Counter of the ends of other kinds than calibrations, by kind and status.
OTHERS_ENDED = "other_jobs_ended"
OTHER_OUTCOMES = tuple(
    (kind, status)
    for kind in get_args(JobKind)
    if kind != "calibration"
    for status in ("succeeded", "failed", "cancelled")
)
RESTARTS = "job_restarts"
# Counter of the view conditions of cameras in calibrations: usable, or why not.
VIEWS = "views"
USABLE = "usable"
VIEW_CONDITIONS = (USABLE, *get_args(Cause))


@dataclass(frozen=True)
class JobOutcome:
    """The outcome of a job, and the times of its life."""

    kind: JobKind
    status: JobStatus
    result: AnyResult | None
    error: JobError | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime
    attempts: int

    def tallies(self) -> Increments:
        """Return the increments of the counters."""
        restarts: Increments = {} if self.started_at is None else {(RESTARTS, ()): self.attempts - 1}
        if self.kind != "calibration":
            return total([{(OTHERS_ENDED, (self.kind, self.status)): 1}, restarts, *self._stages()])
        ended: Increments = {(ENDED, self._outcome()): 1}
        return total([ended, restarts, *self._course(), *self._stages(), *self._quality(), *self._views()])

    def _outcome(self) -> tuple[str, str, str]:
        verdict = self.result.verdict if isinstance(self.result, Result) else ""
        return self.status, verdict, "" if self.error is None else _kind(self.error)

    def _course(self) -> list[Increments]:
        if self.started_at is None:
            return []
        # A clock can be set back, and another server can take over from the database's.
        waited = WAIT.of(max(0.0, (self.started_at - self.created_at).total_seconds()))
        took = DURATION.of(max(0.0, (self.finished_at - self.started_at).total_seconds()))
        return [waited, took]

    def _stages(self) -> list[Increments]:
        if self.result is None:
            return []
        timings = self.result.timings_s
        return [STAGE.of(timings[stage], stage) for stage in STAGES if stage in timings]

    def _quality(self) -> list[Increments]:
        if not isinstance(self.result, Result) or self.result.stitch_error_px is None:
            return []
        return [STITCH_ERROR.of(self.result.stitch_error_px)]

    def _views(self) -> list[Increments]:
        if not isinstance(self.result, Result):
            return []
        views = [camera.view for camera in self.result.cameras if camera.view is not None]
        return [{(VIEWS, (view.cause or USABLE,)): 1} for view in views]


def _kind(error: JobError) -> str:
    return next((kind for kind in ERRORS if kind in PROBLEM_TYPES and error.type == problem_uri(kind)), "other")
