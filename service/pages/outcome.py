"""Outcomes of calibrations: their poses are in use, undone, replaced or never used; and the words for it."""

from dataclasses import dataclass
from typing import Literal

from service.schemas.history import Cause, Revision
from service.schemas.job import Job
from service.schemas.names import Verdict
from service.schemas.results import Result
from service.store.jobs.decisions import OpenDecisions
from service.store.repositories import Repositories
from service.store.revisions import CALIBRATION_CAUSES

Use = Literal["in-use", "undone", "replaced", "never"]
# Causes of revisions in words.
CAME_BY: dict[Cause, str] = {
    "put": "set by hand",
    "calibrated": "calibrated",
    "recovered": "found after a knock",
    "accepted": "accepted by hand",
    "found": "found from frames",
    "adopted": "refined lens stored",
}


@dataclass(frozen=True)
class Headline:
    """The verdict on a calibration in large letters: its words, colour and sign."""

    words: str
    colour: Literal["good", "part", "bad", "plain"]
    sign: str


@dataclass(frozen=True)
class PosesInUse:
    """The revision in use, and the one that its poses first came with: of a restored revision, the one put back."""

    revision: Revision
    origin: Revision

    @property
    def words(self) -> str:
        """Name the revision in use: `revision 5 (poses of revision 3)`."""
        number, origin = self.revision.revision, self.origin.revision
        came = f"poses of revision {origin}" if origin != number else CAME_BY.get(self.origin.cause, "")
        return f"revision {number} ({came})" if came else f"revision {number}"

    def is_of(self, job_id: str) -> bool:
        """True if this calibration brought the poses."""
        return self.origin.job == job_id and self.origin.cause in CALIBRATION_CAUSES


@dataclass(frozen=True)
class Outcome:
    """The fate of the poses that a calibration found, and what can still be decided about them."""

    use: Use
    headline: Headline
    poses_in_use: PosesInUse
    decidable: OpenDecisions

    @property
    def is_in_use(self) -> bool:
        """True if these poses are in use."""
        return self.use == "in-use"


def outcome_of(context: Repositories, job: Job | None, in_use: PosesInUse | None) -> Outcome | None:
    """Return the outcome of a calibration; None for a job without poses, or of a deleted venue."""
    if job is None or in_use is None or not isinstance(job.result, Result):
        return None
    use, decidable = _use(context, job, in_use), context.decisions.decidable(job.id)
    dry_run = bool(job.options.get("dry_run"))
    headline = _headline(job.result.verdict, use, in_use, decidable, dry_run=dry_run)
    return Outcome(use, headline, in_use, decidable)


def poses_in_use(context: Repositories, venue_id: str | None) -> PosesInUse | None:
    """Return the poses that a venue has now; None without a venue."""
    found = context.venues.newest_with_origin(venue_id) if venue_id else None
    return None if found is None else PosesInUse(*found)


def _use(context: Repositories, job: Job, in_use: PosesInUse) -> Use:
    if in_use.is_of(job.id):
        return "in-use"
    if job.venue is None or job.venue_revision is None:
        return "never"
    # The revision right after these poses.
    (after,) = context.venues.history(job.venue, job.venue_revision + 2, 1)
    return "undone" if after.cause == "restored" else "replaced"


def _headline(verdict: Verdict, use: Use, in_use: PosesInUse, decidable: OpenDecisions, *, dry_run: bool) -> Headline:
    if use in ("undone", "replaced"):
        return Headline(use.capitalize(), "plain", "again")
    if use == "in-use" and in_use.origin.cause == "accepted" and not decidable.accept:
        # Green only where the gate has nothing against them.
        return Headline("Accepted by hand", "good" if verdict == "accepted" else "part", "check")
    if verdict == "partly" or (use == "in-use" and in_use.origin.cause == "accepted"):
        return Headline("Partly accepted", "part", "alert")
    if verdict == "accepted":
        return Headline("Accepted, dry run" if dry_run and use == "never" else "Accepted", "good", "check")
    return Headline("Rejected", "bad", "cross")
