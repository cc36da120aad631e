"""The job program computes one job in a process of its own: reads the request, runs the engine, draws, reports.

`python -m worker.jobs.program` reads a `worker.protocol.JobRequest` with its files on its standard input and prints a
line of JSON for each step of progress and one for the end, a `Message` each; pictures follow the last line. It decodes
what strangers sent, so it sees no database, no store and no settings: its parent reads and writes them.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence

import cv2

from service import child_process
from service.schemas.find import SoughtSite
from service.schemas.job import Progress
from service.schemas.options import FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions
from service.schemas.results import AnyResult
from service.store.jobs.task import Task
from worker.jobs.from_schemas import JobFailedError
from worker.jobs.to_schemas import Solution
from worker.protocol import ComputeResources, JobRequest, Message

BEHIND_THE_OTHERS = 10
"""Niceness: answers of the API and heartbeats of the worker on the same machine go before the computation."""


def main() -> None:
    """Compute the job that the parent has begun."""
    child_process.begin_decoder()
    os.nice(BEHIND_THE_OTHERS)
    parent = Parent()
    logging.basicConfig(handlers=[parent], format="%(message)s")
    given, files = JobRequest.read(sys.stdin.buffer)
    try:
        solution = _compute(given.task, files, given.means, lambda progress: parent.told(Message(progress=progress)))
    except JobFailedError as failure:
        parent.told(Message(error=failure.error))
        return
    sizes = {name: len(picture) for name, picture in solution.pictures.items()}
    last = Message(result=solution.result, pictures=sizes, later=list(solution.later), memories=dict(solution.memories))
    parent.told(last, *solution.pictures.values())


def _compute(
    task: Task, files: Mapping[str, Sequence[bytes]], means: ComputeResources, report: Callable[[Progress], None]
) -> Solution[AnyResult]:
    """What the kind of the job asks for; what other kinds need is not loaded."""
    cv2.setNumThreads(means.threads)
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
        case options:
            from worker.jobs import calibration

            assert task.venue is not None
            nights = calibration.NightHistory(task.last_views, task.memories, task.anchors, task.taken_at)
            return calibration.solve(task.venue, files, options, means, report, nights)


def _site_of(task: Task, options: FindOptions, files: Mapping[str, Sequence[bytes]]) -> SoughtSite:
    """The site whose cameras are to be found: the one that was sent, or the stored venue."""
    if task.site is not None:
        return task.site
    assert task.venue is not None
    return SoughtSite.of(task.venue, options, files)


class Parent(logging.Handler):
    """The process that started this one, at the other end of the standard output; warnings go there too.

    The standard output is kept for messages: whatever native code prints goes to the log.
    """

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._messages = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)

    def told(self, message: Message, *files: bytes) -> None:
        """Say it, and hand over the files behind it."""
        self._messages.write(message.line().encode() + b"\n")
        self._messages.writelines(files)
        self._messages.flush()

    def emit(self, record: logging.LogRecord) -> None:
        """Say a line of the log, which the parent knows the job of."""
        self.told(Message(warning=self.format(record)))


if __name__ == "__main__":
    main()
