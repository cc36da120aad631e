"""The job program computes one job in a process of its own: reads the request, runs the engine, draws, reports.

`python -m worker.jobs.program` reads a `worker.protocol.JobRequest` with its files on its standard input and prints a
line of JSON for each step of progress and one for the end, a `worker.protocol.Message` each; pictures follow the last
line. It decodes what strangers sent, so it sees no database, no store and no settings: its parent reads and writes
them.

Nearly every job is a calibration near its stored poses, and begins this program anew. So a calibration loads what that
needs and no models of the wire: its parent has checked the request, and checks the answer. Other kinds load the models.
"""

import json
import logging
import math
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import cv2
import numpy as np

from service import child_process
from service.schemas.names import OWN_QUEUES
from worker.compute_resources import ComputeResources
from worker.jobs.documents import Document, Progress, parse, parse_task
from worker.jobs.from_schemas import JobFailedError
from worker.jobs.to_schemas import Solution

if TYPE_CHECKING:
    from service.schemas.find import SoughtSite
    from service.schemas.options import FindOptions, Options
    from service.schemas.venue import Venue
    from service.store.jobs.task import Task

BEHIND_THE_OTHERS = 10
"""Niceness: answers of the API and heartbeats of the worker on the same machine go before the computation."""
BEHIND_CALIBRATIONS = 9
"""So much more of it for a search, which runs beside calibrations and leaves them nearly all of a core: nine tenths."""


def main() -> None:
    """Compute the job that the parent has begun."""
    child_process.begin_decoder()
    os.nice(BEHIND_THE_OTHERS)
    parent = Parent()
    logging.basicConfig(handlers=[parent], format="%(message)s")
    request, files = read_request(sys.stdin.buffer)
    if OWN_QUEUES.get(request["task"]["kind"]) == "search":
        os.nice(BEHIND_CALIBRATIONS)
    means = ComputeResources(**request["means"] | {"model": Path(request["means"]["model"])})
    try:
        solution = _compute(request["task"], files, means, lambda progress: parent.send({"progress": progress}))
    except JobFailedError as failure:
        parent.send({"error": failure.error})
        return
    except Exception as error:
        if not _is_lack_of_memory(error):
            raise
        parent.send({"error": _without_memory().error})
        return
    last = {
        "result": solution.result.model_dump(mode="json"),
        "pictures": {name: len(picture) for name, picture in solution.pictures.items()},
        "later": list(solution.later),
        "memories": dict(solution.memories),
    }
    parent.send(last, *solution.pictures.values())


def _is_lack_of_memory(error: Exception) -> bool:
    """Return True for the errors by which NumPy, OpenCV and ONNX Runtime say that no memory was left."""
    if isinstance(error, MemoryError) or (isinstance(error, cv2.error) and error.code == cv2.Error.StsNoMem):
        return True
    return "bad_alloc" in str(error) or "allocate memory" in str(error)


def _without_memory() -> JobFailedError:
    most_mb = child_process.memory_limit_mb()
    allowed = "there is" if most_mb is None else f"the {most_mb:g} MB that one job may take (ESC_JOB_MEMORY_MB)"
    detail = f"The frames need more memory than {allowed}. Send fewer frames of each camera, or smaller ones."
    return JobFailedError("job-crashed", detail)


def read_request(stream: IO[bytes]) -> tuple[Document, dict[str, list[bytes]]]:
    """Read a request that `JobRequest.write` wrote, as a document, and its files."""
    request = parse(stream.readline())
    return request, {name: [stream.read(size) for size in several] for name, several in request["sizes"].items()}


def _compute(
    task: Document,
    files: Mapping[str, Sequence[bytes]],
    means: ComputeResources,
    report: Callable[[Progress], None],
) -> Solution[Any]:
    """Compute a job by its kind; modules of the other kinds are not loaded."""
    cv2.setNumThreads(means.threads)
    if task["kind"] != "calibration":
        return _compute_by_models(task, files, means, report)
    from worker.jobs import calibration

    given = parse_task(task)
    nights = calibration.NightHistory(given.last_views, given.memories, given.anchors, given.taken_at)
    return calibration.solve(cast("Venue", given.venue), files, cast("Options", given.options), means, report, nights)


def _compute_by_models(
    document: Document,
    files: Mapping[str, Sequence[bytes]],
    means: ComputeResources,
    report: Callable[[Progress], None],
) -> Solution[Any]:
    """Compute a job of the kinds that are rarely asked for."""
    from service.schemas.check import CheckedFile
    from service.schemas.options import FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions
    from service.store.jobs.task import Task

    task = Task.model_validate(document, extra="ignore")
    match task.options:
        case IntrinsicsOptions() as options:
            from worker.jobs import intrinsics

            return intrinsics.solve({name: photo for name, (photo,) in files.items()}, options, report)
        case LocateOptions() as options:
            from worker.jobs import locate

            assert task.venue is not None
            ((camera, frames),) = files.items()
            return locate.solve(task.venue, camera, options, next(iter(frames), None), report)
        case FieldOptions() as options:
            from worker.jobs import field

            assert task.venue is not None
            return field.solve(task.venue, files, options, means, report)
        case FindOptions() as options:
            from worker.jobs import find

            return find.solve(_site_of(task, options, files), files, options.seed or 0, means, report)
        case CheckedFile() as given:
            from worker.jobs import check

            return check.solve(given, files, means, report)
        case _:
            raise AssertionError(task.kind)


def _site_of(task: "Task", options: "FindOptions", files: Mapping[str, Sequence[bytes]]) -> "SoughtSite":
    """Return the site whose cameras are to be found: the one that was sent, or the stored venue."""
    from service.schemas.find import SoughtSite

    if task.site is not None:
        return task.site
    assert task.venue is not None
    return SoughtSite.of(task.venue, options, files)


def encode(message: Mapping[str, Any]) -> bytes:
    """The line of JSON of a message."""
    return json.dumps(_plain(message), ensure_ascii=False).encode()


def _plain(value: Any) -> Any:
    """Return a value with plain numbers for NumPy's, and None for numbers that JSON lacks."""
    match value:
        case dict():
            return {name: _plain(one) for name, one in value.items()}
        case list() | tuple():
            return [_plain(one) for one in value]
        case float():
            return float(value) if math.isfinite(value) else None
        case np.generic():
            return _plain(value.item())
        case _:
            return value


class Parent(logging.Handler):
    """The process that started this one, at the other end of the standard output; warnings go there too.

    The standard output is kept for messages: whatever native code prints goes to the log.
    """

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._messages = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)

    def send(self, message: Mapping[str, Any], *files: bytes) -> None:
        """Write a `worker.protocol.Message` as a line of JSON, and the files behind it."""
        self._messages.write(encode(message) + b"\n")
        self._messages.writelines(files)
        self._messages.flush()

    def emit(self, record: logging.LogRecord) -> None:
        """Send a line of the log to the parent, which adds the job."""
        self.send({"warning": self.format(record)})


if __name__ == "__main__":
    main()
