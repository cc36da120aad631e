"""What commands share that compute on this machine, without a service."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.cli.arguments import files_of, settings_of
from service.cli.printing import FAILED, fail, in_words
from service.intake import images
from service.wire.problems import Problem
from service.wire.venue import Venue

if TYPE_CHECKING:
    from service.settings import Settings


def engine_settings() -> Settings:
    """The settings, also in the environment: native libraries read theirs when they are loaded, so call it before."""
    settings = settings_of()
    os.environ |= settings.native_environment
    return settings


def checked_files(stored: Venue, frames: Sequence[str], settings: Settings) -> dict[str, list[bytes]]:
    """Frames by camera, as the service would let them in."""
    files = {camera: [path.read_bytes() for path in paths] for camera, paths in files_of(frames).items()}
    with failure_told():
        images.check_cameras(stored, {camera: len(several) for camera, several in files.items()}, settings)
        for camera in stored.cameras:
            for data in files[camera.id]:
                images.check(camera, data, settings)
    return files


@contextmanager
def failure_told() -> Iterator[None]:
    """What is refused, and what a job without a server fails of, is a line."""
    from worker.jobs.wire import Failure

    try:
        yield
    except Problem as problem:
        fail(in_words(problem.detail, problem.parts), FAILED)
    except Failure as failure:
        fail(failure.error.detail, FAILED)
