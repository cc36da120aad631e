"""The job program computes one job in a process of its own: reads the request, runs the engine, draws, reports.

`python -m worker.jobs.program` reads a `worker.protocol.JobRequest` with its files on its standard input and prints a
line of JSON for each step of progress and one for the end, a `worker.protocol.Message` each; pictures follow the last
line. It decodes what strangers sent, so it sees no database, no store and no settings: its parent reads and writes
them.

Its worker forks it from a process that has imported all kinds of jobs: `worker.fork_server`.
"""

import logging
import os
import sys
from collections.abc import Callable
from typing import Any, assert_never

import cv2

from service import child_process
from service.schemas.check import CheckedFile
from service.schemas.find import SoughtSite
from service.schemas.job import Progress
from service.schemas.names import OWN_QUEUES
from service.schemas.options import FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions, Options
from service.schemas.venue import Venue
from service.store.jobs.task import Task
from worker.compute_resources import ComputeResources
from worker.jobs import calibration, check, field, find, intrinsics, locate
from worker.jobs.from_schemas import JobFailedError
from worker.jobs.to_schemas import Solution
from worker.protocol import Files, JobRequest, Message

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
    request, files = JobRequest.read(sys.stdin.buffer)
    if OWN_QUEUES.get(request.task.kind) == "search":
        os.nice(BEHIND_CALIBRATIONS)
    try:
        solution = _compute(request.task, files, request.means, lambda step: parent.send(Message(progress=step)))
    except JobFailedError as failure:
        parent.send(Message(error=failure.error))
        return
    except Exception as error:
        if not _is_lack_of_memory(error):
            raise
        parent.send(Message(error=_without_memory().error))
        return
    last = Message(
        result=solution.result,
        pictures={name: len(picture) for name, picture in solution.pictures.items()},
        later=list(solution.later),
        memories=dict(solution.memories),
    )
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


def _compute(task: Task, files: Files, means: ComputeResources, report: Callable[[Progress], None]) -> Solution[Any]:
    """Compute a job by its kind."""
    cv2.setNumThreads(means.threads)
    match task.options:
        case Options() as options:
            nights = calibration.NightHistory.of(task)
            return calibration.solve(_venue_of(task), files, options, means, report, nights)
        case IntrinsicsOptions() as options:
            return intrinsics.solve({name: photo for name, (photo,) in files.items()}, options, report)
        case LocateOptions() as options:
            ((camera, frames),) = files.items()
            return locate.solve(_venue_of(task), camera, options, next(iter(frames), None), report)
        case FieldOptions() as options:
            return field.solve(_venue_of(task), files, options, means, report)
        case FindOptions() as options:
            # The site that was sent, or else the stored venue.
            site = task.site or SoughtSite.of(_venue_of(task), options, files)
            return find.solve(site, files, options.seed or 0, means, report)
        case CheckedFile() as given:
            return check.solve(given, files, means, report)
        case _ as unknown:
            assert_never(unknown)


def _venue_of(task: Task) -> Venue:
    assert task.venue is not None
    return task.venue


class Parent(logging.Handler):
    """The process that started this one, at the other end of the standard output; warnings go there too.

    The standard output is kept for messages: whatever native code prints goes to the log.
    """

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._messages = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)

    def send(self, message: Message, *files: bytes) -> None:
        """Write a message as a line of JSON, and the files behind it."""
        self._messages.write(message.model_dump_json().encode() + b"\n")
        self._messages.writelines(files)
        self._messages.flush()

    def emit(self, record: logging.LogRecord) -> None:
        """Send a line of the log to the parent, which adds the job."""
        self.send(Message(warning=self.format(record)))


if __name__ == "__main__":
    main()
