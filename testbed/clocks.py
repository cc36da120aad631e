"""A clock that all processes of a service read, and that is put elsewhere while they run."""

import os
from pathlib import Path

MOVED_CLOCK = Path(__file__).parent / "moved_clock"


class Clock:
    """A clock whose offset stands in a file, which the processes that have its `environment` read each time."""

    def __init__(self, folder: Path, ahead_s: float = 0) -> None:
        self._file = folder / "clock"
        self.put(ahead_s)
        path = os.pathsep.join([str(MOVED_CLOCK), *filter(None, [os.environ.get("PYTHONPATH")])])
        self.environment = {"MOVED_CLOCK": str(self._file), "PYTHONPATH": path}

    def put(self, ahead_s: float) -> None:
        """Put it so far ahead, for all who read it at once."""
        new = self._file.with_suffix(".new")
        new.write_text(str(ahead_s))
        new.replace(self._file)
