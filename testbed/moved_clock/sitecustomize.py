"""In front of `PYTHONPATH`: a process whose clock is moved by the seconds in the file that `MOVED_CLOCK` names.

What measures how long something takes (`time.monotonic`) goes on, as it does when the clock of a machine is set.
"""

import os
import sys
import time
from datetime import datetime
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from pathlib import Path

# Those that ask for the time of day.
MODULES = ("service.store.database", "service.store.sessions", "service.store.keys", "service.api.auth")
real_time = time.time


def moved_time() -> float:
    return real_time() + float(Path(os.environ["MOVED_CLOCK"]).read_text())


class MovedDatetime(datetime):
    @classmethod
    def now(cls, tz=None):
        return datetime.fromtimestamp(moved_time(), tz)


class Finder(MetaPathFinder):
    """Gives these modules the moved clock once they have been loaded."""

    def find_spec(self, name, path, target=None):
        if name not in MODULES:
            return None
        spec = PathFinder.find_spec(name, path, target)
        load = spec.loader.exec_module

        def exec_module(module):
            load(module)
            module.datetime = MovedDatetime

        spec.loader.exec_module = exec_module
        return spec


if "MOVED_CLOCK" in os.environ:
    time.time = moved_time
    sys.meta_path.insert(0, Finder())
