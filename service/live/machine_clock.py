"""The clock of this machine: the kernel says if something holds it to another clock."""

import ctypes
from functools import cache

# Linux's `struct timex` and room to spare; all zero, it asks and changes nothing.
STATE_BYTES = 512
# Return value of `adjtimex` while nothing holds the clock.
TIME_ERROR = 5


def is_clock_locked() -> bool | None:
    """True if a service (NTP, PTP) holds the clock to another one; None if the kernel does not say."""
    state = _c_library().adjtimex(ctypes.create_string_buffer(STATE_BYTES))
    return None if state < 0 else state != TIME_ERROR


@cache
def _c_library() -> ctypes.CDLL:
    """Return the C library, which takes longer to open than to ask; each sample of a stream asks."""
    return ctypes.CDLL(None)
