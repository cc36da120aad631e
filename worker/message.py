"""What a worker and a job's program say to each other, over the program's standard input and output.

In: a line of JSON, a `Given`, and behind it the bytes of the files. Out: lines of JSON, a `Message` each, and behind
the one that has pictures their bytes. So the program needs no store, and nobody tidies up after it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from service.store.jobs.task import Task
from service.wire.job import JobError, Progress
from service.wire.results import AnyResult

if TYPE_CHECKING:
    from service.settings import Settings

Files = Mapping[str, Sequence[bytes]]


class Means(BaseModel):
    """What jobs are computed with: the network, what it runs on, and how many threads a job takes."""

    model: Path
    provider: Literal["cpu", "cuda", "openvino"] = "cpu"
    threads: int

    @classmethod
    def of(cls, settings: Settings) -> Means:
        """As the settings say, wherever the program is started."""
        return cls(model=settings.model.absolute(), provider=settings.provider, threads=settings.threads)


class Given(BaseModel):
    """What a program is given; `sizes`: bytes of the files that follow, frames by camera or photos by name."""

    task: Task
    means: Means
    sizes: dict[str, list[int]]

    @classmethod
    def of(cls, task: Task, means: Means, files: Files) -> Given:
        """A task without what nobody needs to know who computes it."""
        sizes = {name: [len(file) for file in several] for name, several in files.items()}
        return cls(task=task.without_addresses(), means=means, sizes=sizes)

    @classmethod
    def read(cls, stream: IO[bytes]) -> tuple[Given, dict[str, list[bytes]]]:
        """What `write` wrote, with the files."""
        given = cls.model_validate_json(stream.readline())
        return given, {name: [stream.read(size) for size in several] for name, several in given.sizes.items()}

    def write(self, stream: IO[bytes], files: Files) -> None:
        """The line and the bytes."""
        stream.write(self.model_dump_json().encode() + b"\n")
        for several in files.values():
            stream.writelines(several)


class Message(BaseModel):
    """One line: exactly one of progress, warning, result and error. The last two are the program's last word."""

    progress: Progress | None = None
    warning: str | None = None
    result: AnyResult | None = None
    error: JobError | None = None
    # Beside a result: the pictures that follow, and their bytes.
    pictures: dict[str, int] = {}
    # The names of those that can be drawn when somebody looks.
    later: list[str] = []
    # Of a calibration: the memories of the accepted cameras with this job in them, by camera.
    memories: dict[str, dict[str, Any]] = {}

    @property
    def last(self) -> bool:
        """Whether the program has nothing to say behind it."""
        return self.result is not None or self.error is not None

    def line(self) -> str:
        """The line, to be printed."""
        return self.model_dump_json(exclude_unset=True)
