"""Settings, frames and failures of the commands that compute on this machine, without a service.

NumPy and OpenCV read the environment when they are loaded: such a command imports the engine after `engine_settings()`.
"""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from service.cli.arguments import parse_frame_files
from service.cli.printing import FAILED, fail, problem_text
from service.cli.progress import progress_bar
from service.cli.service_settings import load_settings
from service.intake import image_checks
from service.schemas.find import SoughtCameraIn
from service.schemas.job import Progress
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue
from service.settings import Settings


def engine_settings() -> Settings:
    """Return the settings, and set what native libraries read of them in the environment."""
    settings = load_settings()
    os.environ |= settings.native_environment
    return settings


def checked_files(stored: Venue, frames: Sequence[str], settings: Settings) -> dict[str, list[bytes]]:
    """Return the frames of each camera, checked as the service checks an upload."""
    files = read_frames(frames)
    with report_job_failures():
        image_checks.check_cameras(stored, {camera: len(images) for camera, images in files.items()}, settings)
    check_frames(stored.cameras, files, settings)
    return files


def read_frames(frames: Sequence[str]) -> dict[str, list[bytes]]:
    """Return the frames of each camera, from arguments CAMERA=FILE."""
    return {camera: [path.read_bytes() for path in paths] for camera, paths in parse_frame_files(frames).items()}


def check_frames(
    cameras: Sequence[Camera | SoughtCameraIn], files: Mapping[str, Sequence[bytes]], settings: Settings
) -> None:
    """Exit with a line for a frame that is damaged or of another size, before any is decoded."""
    with report_job_failures():
        budget = image_checks.PixelBudget(settings)
        for camera in cameras:
            for data in files.get(camera.id, ()):
                image_checks.check(camera, data, settings, budget)


@contextmanager
def report_job_failures() -> Iterator[None]:
    """Exit with a line where frames are refused or the job fails."""
    from worker.jobs.from_schemas import JobFailedError

    try:
        yield
    except Problem as problem:
        fail(problem_text(problem.detail, problem.parts), FAILED)
    except JobFailedError as failure:
        fail(str(failure), FAILED)


@contextmanager
def engine_progress() -> Iterator[Callable[[Progress], None]]:
    """Show a progress bar of the steps that the yielded function takes; exit with a line where the job fails."""
    with report_job_failures(), progress_bar() as show:
        yield lambda step: show(step.stage, step.fraction)
