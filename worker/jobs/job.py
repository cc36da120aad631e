"""One job, in a process of its own: load, compute what its kind asks for, draw, hand back.

`python -m worker.jobs.job` reads a `Task` on its standard input and prints a line of JSON for each step of progress and
one for the end, a `worker.message.Message` each. It decodes what strangers sent, so it sees no database: its parent
writes the rows.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence

import cv2
import structlog

from service import lifeline
from service.observe import logs
from service.settings import Settings
from service.store.blobs import AWAY, Blobs
from service.store.jobs.files import picture_file, picture_folder
from service.store.jobs.task import Task
from service.wire.job import Progress
from service.wire.options import FieldOptions, IntrinsicsOptions, LocateOptions
from service.wire.problems import first_line
from service.wire.results import AnyResult
from worker.jobs import calibration, field, intrinsics, locate
from worker.jobs.wire import Failure, Solution
from worker.message import Message

BEHIND_THE_OTHERS = 10
"""Niceness: answers of the API and heartbeats of the worker on the same machine go before the computation."""


def main() -> None:
    """Compute the job that the parent has begun."""
    lifeline.end_with_parent()
    os.nice(BEHIND_THE_OTHERS)
    say = _line_to_parent()
    # The parent says all there is to know: a file of settings may hold the password of the database.
    settings = Settings(_env_file=None)
    logs.configure(settings)
    task = Task.model_validate_json(sys.stdin.buffer.read())
    structlog.contextvars.bind_contextvars(job=task.job_id, **task.origin.names())
    blobs = Blobs(settings.home_blob_url)
    try:
        solution = _compute(task, _load(task, blobs), settings, lambda progress: say(Message(progress=progress)))
        _store(task, blobs, solution.pictures)
    except Failure as failure:
        say(Message(error=failure.error))
        return
    say(Message(result=solution.result, pictures=list(solution.pictures)))


def _compute(
    task: Task, files: Mapping[str, Sequence[bytes]], settings: Settings, report: Callable[[Progress], None]
) -> Solution[AnyResult]:
    """What the kind of the job asks for."""
    cv2.setNumThreads(settings.threads)
    match task.options:
        case IntrinsicsOptions() as options:
            return intrinsics.solve({name: photo for name, (photo,) in files.items()}, options, report)
        case LocateOptions() as options:
            assert task.venue is not None
            ((camera, frames),) = files.items()
            return locate.solve(task.venue, camera, options, next(iter(frames), None), report)
        case FieldOptions() as options:
            assert task.venue is not None
            return field.solve(task.venue, files, options, settings, report)
        case options:
            assert task.venue is not None
            return calibration.solve(task.venue, files, options, settings, report, task.last_views)


def _line_to_parent() -> Callable[[Message], None]:
    """Keep standard output for messages; whatever native code prints goes to the log."""
    messages = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def say(message: Message) -> None:
        print(message.line(), file=messages, flush=True)

    return say


def _load(task: Task, blobs: Blobs) -> dict[str, list[bytes]]:
    files: dict[str, list[bytes]] = {}
    for camera, paths in task.frames.items():
        files[camera] = []
        for path in paths:
            try:
                data = blobs.get(path)
            except AWAY as error:
                raise Failure("job-crashed", f"A stored frame cannot be read: {first_line(error)}", camera) from error
            if data is None:
                raise Failure("job-crashed", f"The stored frame {path} is gone.", camera)
            files[camera].append(data)
    return files


def _store(task: Task, blobs: Blobs, pictures: Mapping[str, bytes]) -> None:
    for name, picture in pictures.items():
        try:
            blobs.put(f"{picture_folder(task.job_id, task.run_token)}/{picture_file(name)}", picture)
        except AWAY as error:
            raise Failure("job-crashed", f"Its pictures cannot be stored: {first_line(error)}") from error


if __name__ == "__main__":
    main()
