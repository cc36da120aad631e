"""Ids of jobs and events."""

import os
import time

CROCKFORD = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"


def new_id() -> str:
    """A ULID: 48 bits of milliseconds and 80 of chance in Crockford's base 32, so ids sort by time.

    It is the time of the process that makes the id, not the database's: while the clock of an API is ahead, its jobs
    sort behind those of the others, and for as long after it was put right. Times of jobs are the database's.
    """
    number = int(time.time() * 1000) << 80 | int.from_bytes(os.urandom(10))
    return "".join(CROCKFORD[number >> shift & 31] for shift in range(125, -1, -5))
