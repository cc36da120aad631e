"""Protocol between a worker and a job program, over standard input and output.

In: a line of JSON, a `JobRequest`, and the bytes of the files. Out: lines of JSON, a `Message` each; the bytes of
the pictures follow the line that announces them. So the program needs no store, and nobody tidies up after it.
"""

from collections.abc import Mapping, Sequence
from typing import IO, Any, assert_never

from pydantic import BaseModel

from service.schemas.base import TOLERANTLY
from service.schemas.check import CheckResult
from service.schemas.job import JobError, Progress
from service.schemas.results import AnyResult, FieldResult, FindResult, IntrinsicsResult, LocateResult, Result
from service.store.jobs.task import Task
from worker.compute_resources import ComputeResources

Files = Mapping[str, Sequence[bytes]]


class JobRequest(BaseModel):
    """The request that starts a job program.

    `sizes`: bytes of the files that follow, frames by camera or photos by name. The names of the fields are those of
    the protocol.
    """

    task: Task
    means: ComputeResources
    sizes: dict[str, list[int]]

    @classmethod
    def of(cls, task: Task, means: ComputeResources, files: Files) -> "JobRequest":
        """Return the request for a task, without the addresses that its program does not need."""
        sizes = {name: [len(file) for file in several] for name, several in files.items()}
        return cls(task=task.without_addresses(), means=means, sizes=sizes)

    def write(self, stream: IO[bytes], files: Files) -> None:
        """Write the request as a line of JSON, then the bytes of the files."""
        stream.write(self.model_dump_json().encode() + b"\n")
        for several in files.values():
            stream.writelines(several)

    @classmethod
    def read(cls, stream: IO[bytes]) -> tuple["JobRequest", Files]:
        """Return a request that was written, and its files."""
        request = cls.model_validate_json(stream.readline(), **TOLERANTLY)
        return request, {name: [stream.read(size) for size in several] for name, several in request.sizes.items()}


class Message(BaseModel):
    """One line of output: exactly one of progress, warning, result and error. Result and error end the job."""

    progress: Progress | None = None
    warning: str | None = None
    result: AnyResult | None = None
    error: JobError | None = None
    # With a result: the pictures that follow, and their bytes.
    pictures: dict[str, int] = {}
    # With a result: the names of pictures that can be drawn when somebody looks.
    later: list[str] = []
    # With the result of a calibration: the memories of the accepted cameras with this job in them, by camera.
    memories: dict[str, dict[str, Any]] = {}

    @property
    def verdict(self) -> str | None:
        """Return how the job ended in a word: the verdict on its poses, or the kind of its error."""
        match self.result:
            case None:
                return None if self.error is None else self.error.type.rpartition("/")[2]
            case Result():
                return self.result.verdict
            case IntrinsicsResult():
                return "found"
            case CheckResult():
                return self.result.grade
            case LocateResult() | FindResult() | FieldResult():
                return "accepted" if self.result.accepted else "rejected"
            case _ as unknown:
                assert_never(unknown)

    @property
    def outcome(self) -> dict[str, Any]:
        """Return the verdict, with the reason and the cameras of a rejection or failure, for the log."""
        named: dict[str, Any] = {}
        match self.result:
            case None if self.error is not None:
                named = {"why": self.error.detail, "cameras": [self.error.camera] if self.error.camera else []}
            case Result() | FindResult() as found:
                named = {"cameras": [camera.id for camera in found.cameras if not camera.accepted]}
                named["why"] = found.rejected_because
            case CheckResult() as checked:
                named = {"cameras": [*checked.failing], "why": "; ".join(checked.failing.values())}
            case LocateResult() | FieldResult() as found:
                named = {"why": found.rejected_because}
        return {"verdict": self.verdict} | {name: value for name, value in named.items() if value}

    @property
    def last(self) -> bool:
        """True if no other message follows."""
        return self.result is not None or self.error is not None

    def without_pictures(self, why: str) -> "Message":
        """Return the message whose result says that the pictures that came with it are missing."""
        if self.result is None:
            return self
        warnings = [*self.result.warnings, why]
        return self.model_copy(update={"result": self.result.model_copy(update={"warnings": warnings}), "pictures": {}})
