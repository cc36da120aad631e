"""What is answered where a venue or a job is not there, or not there for the key that asks."""

from __future__ import annotations

from service.schemas.problems import Problem
from service.settings import Settings


def no_such_venue(venue_id: str) -> Problem:
    """Answer who names a venue that is not there."""
    return Problem("venue-not-found", f"PUT /venues/{venue_id} creates it; GET /venues lists those there are.")


def no_such_job(settings: Settings) -> Problem:
    """Answer who names a job that is not there."""
    kept = f"{settings.keep_jobs_days:g} days"
    return Problem("job-not-found", f"GET /jobs lists those there are; they are deleted {kept} after their end.")
