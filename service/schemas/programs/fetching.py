"""What is known of a source that was asked for a frame."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SourceFetch:
    """One source that was asked for a frame: the seconds that it took, and whether a frame came."""

    seconds: float
    got_frame: bool
