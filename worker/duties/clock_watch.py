"""Detects that a wall clock was set back: times that were computed by it before lie too far ahead."""

import time
from datetime import datetime

# A smaller difference from the monotonic clock is drift, not a step.
STEP_S = 5.0


class ClockWatch:
    """Compares a wall clock with the monotonic clock. Not thread-safe."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None

    def was_put_back(self, now: datetime) -> bool:
        """True if the clock was set back since the last call, and at the first call: the time before is unknown."""
        ahead_s = now.timestamp() - time.monotonic()
        before, self._ahead_s = self._ahead_s, ahead_s
        return before is None or ahead_s < before - STEP_S
