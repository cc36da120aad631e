"""Outcome of fetching a frame from a source."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SourceFetch:
    """Fetch of one source: its duration, and whether it gave a frame."""

    seconds: float
    got_frame: bool
