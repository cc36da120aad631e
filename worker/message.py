"""What a job's program says to the worker that started it: lines of JSON on its standard output."""

from __future__ import annotations

from pydantic import BaseModel

from service.wire.job import JobError, Progress
from service.wire.results import AnyResult


class Message(BaseModel):
    """One line: exactly one of progress, result and error. `error` and `result` are the program's last word."""

    progress: Progress | None = None
    result: AnyResult | None = None
    error: JobError | None = None
    # Beside a result: the pictures that lie in the folder of the attempt.
    pictures: list[str] = []

    def line(self) -> str:
        """The line, to be printed."""
        return self.model_dump_json(exclude_unset=True)
