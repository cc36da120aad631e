"""Rate limit for log lines about an unavailable database or bucket: one a minute for each event, without tracebacks.

During an outage everything that needs the database fails, some many times a second and always in the same place: a
traceback says no more than the first line of the error.
"""

import logging
import sys
import threading
import time
from collections.abc import MutableMapping
from typing import Any

import structlog

EVERY_S = 60.0
# Packages and errors of drivers and pools, by name: checking types would import them.
OF_DRIVERS = ("psycopg", "psycopg_pool", "sqlite3", "sqlalchemy")
DRIVER_OUTAGES = ("OperationalError", "InterfaceError", "InternalError", "TimeoutError", "PoolTimeout")


class OutageLines:
    """Lets one line a minute pass for each event and type of error; the next one says how many were left out."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._next_s: dict[tuple[str, str], float] = {}
        self._left_out: dict[tuple[str, str], int] = {}

    def structured(self, _: Any, __: str, line: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        """Shorten or drop a line of structlog (a processor)."""
        error = _error_in(line.get("exc_info"))
        if error is not None and _is_outage(error):
            left_out = self._left_out_before(str(line["event"]), error)
            if left_out is None:
                raise structlog.DropEvent
            del line["exc_info"]
            line.update(_in_words(error, left_out))
        return line

    def filter(self, record: logging.LogRecord) -> bool:
        """Shorten or drop a line of the standard library (a filter of a handler)."""
        error = _error_in(record.exc_info)
        if error is not None and _is_outage(error):
            # The message without its arguments, which differ from job to job.
            left_out = self._left_out_before(f"{record.name} {record.msg}", error)
            if left_out is None:
                return False
            record.exc_info = record.exc_text = None
            words = ", ".join(f"{name}: {value}" for name, value in _in_words(error, left_out).items())
            record.msg, record.args = f"{record.getMessage()} ({words})", ()
        return True

    def _left_out_before(self, event: str, error: BaseException) -> int | None:
        """Return the number of lines left out since the last one; None if this one is left out, too."""
        key, now = (event, type(error).__name__), time.monotonic()
        with self._lock:
            if now < self._next_s.get(key, now):
                self._left_out[key] = self._left_out.get(key, 0) + 1
                return None
            self._next_s[key] = now + EVERY_S
            return self._left_out.pop(key, 0)


def _error_in(exc_info: Any) -> BaseException | None:
    match exc_info:
        case BaseException():
            return exc_info
        case (_, BaseException() as error, _):
            return error
        case True:
            return sys.exc_info()[1]
        case _:
            return None


def _is_outage(error: BaseException) -> bool:
    if type(error).__module__.partition(".")[0] in OF_DRIVERS:
        return any(kind.__name__ in DRIVER_OUTAGES for kind in type(error).__mro__)
    # The client alone is installed without the store.
    blobs = sys.modules.get("service.store.blobs")
    return blobs is not None and isinstance(error, blobs.BLOB_OUTAGES)


def _in_words(error: BaseException, left_out: int) -> dict[str, Any]:
    first_line = (str(error).splitlines() or [""])[0]
    words: dict[str, Any] = {"error": f"{type(error).__name__}: {first_line}"}
    return {**words, "left_out": left_out} if left_out else words
