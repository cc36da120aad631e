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
        parts: list[Increments] = []
        if self.started_at is not None:
            parts.append({(RESTARTS, ()): self.attempts - 1})
        timings = {} if self.result is None else self.result.timings_s
        parts += [STAGE.of(timings[stage], stage) for stage in STAGES if stage in timings]
        if self.kind != "calibration":
            return total([{(OTHERS_ENDED, (self.kind, self.status)): 1}, *parts])
        if self.started_at is not None:
            # A clock can be set back, and another server can take over from the database's.
            parts.append(WAIT.of(max(0.0, (self.started_at - self.created_at).total_seconds())))
            parts.append(DURATION.of(max(0.0, (self.finished_at - self.started_at).total_seconds())))
        verdict = ""
        if isinstance(self.result, Result):
            verdict = self.result.verdict
            views = [camera.view for camera in self.result.cameras if camera.view is not None]
            parts += [{(VIEWS, (view.cause or USABLE,)): 1} for view in views]
            if self.result.stitch_error_px is not None:
                parts.append(STITCH_ERROR.of(self.result.stitch_error_px))
        error = "" if self.error is None else _kind(self.error)
        return total([{(ENDED, (self.status, verdict, error)): 1}, *parts])


def _kind(error: JobError) -> str:
    return next((kind for kind in ERRORS if kind in PROBLEM_TYPES and error.type == problem_uri(kind)), "other")
