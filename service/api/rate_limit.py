"""Rate limits: token buckets in the memory of one process."""

import heapq
import time
from collections.abc import Callable

# Part of a token that may be missing: sums of floats are not exact.
ROUNDING = 1e-3


class TokenBuckets:
    """Token buckets by name. A full one holds `burst` tokens, and `per_s` tokens a second flow in.

    Each name needs one number, the moment at which its bucket will be full again. A full bucket and an unknown one are
    the same, so memory is bounded by forgetting those that are full soonest, beyond `at_most` names.
    """

    def __init__(
        self, per_s: float, burst: int, *, at_most: int = 10_000, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._interval_s = 1 / per_s
        # With less than this missing there is a token.
        self._slack_s = (burst - 1 + ROUNDING) / per_s
        self._at_most = at_most
        self._clock = clock
        self._full_at: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._full_at)

    def wait_s(self, name: str) -> float:
        """Return the seconds until there is a token, 0 if there is one."""
        now = self._clock()
        return max(0.0, self._full_at.get(name, now) - now - self._slack_s)

    def take(self, name: str) -> None:
        """Take a token, on credit if there is none."""
        now = self._clock()
        self._full_at[name] = max(self._full_at.get(name, now), now) + self._interval_s
        if len(self._full_at) > self._at_most:
            kept = heapq.nlargest(self._at_most // 2, self._full_at.items(), key=lambda entry: entry[1])
            self._full_at = dict(kept)

    def give_back(self, name: str) -> None:
        """Put back a token that was taken, as if it had not been."""
        if name in self._full_at:
            self._full_at[name] -= self._interval_s
