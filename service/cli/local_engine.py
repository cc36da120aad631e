"""What commands share that compute on this machine, without a service."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.cli.arguments import load_settings, parse_frame_files
from service.cli.printing import FAILED, fail, problem_text
from service.intake import image_checks
from service.schemas.problems import Problem
from service.schemas.venue import Venue

if TYPE_CHECKING:
    from service.settings import Settings


def engine_settings() -> Settings:
    """The settings, also in the environment: native libraries read theirs when they are loaded, so call it before."""
    settings = load_settings()
    os.environ |= settings.native_environment
    return settings


def checked_files(stored: Venue, frames: Sequence[str], settings: Settings) -> dict[str, list[bytes]]:
    """Frames by camera, as the service would let them in."""
    files = {camera: [path.read_bytes() for path in paths] for camera, paths in parse_frame_files(frames).items()}
    with report_job_failures():
        image_checks.check_cameras(stored, {camera: len(several) for camera, several in files.items()}, settings)
        budget = image_checks.PixelBudget(settings)
        for camera in stored.cameras:
            for data in files[camera.id]:
                image_checks.check(camera, data, settings, budget)
    return files


@contextmanager
def report_job_failures() -> Iterator[None]:
    """What is refused, and what a job without a server fails of, is a line."""
    from worker.jobs.from_schemas import JobFailedError

    try:
        yield
    except Problem as problem:
        fail(problem_text(problem.detail, problem.parts), FAILED)
    except JobFailedError as failure:
        fail(str(failure), FAILED)
