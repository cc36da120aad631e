"""The progress bar of a command that waits for a calibration, here or in a service."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from service.cli.answers import job_exit_code, print_answer, print_submitted
from service.client import Client
from service.schemas.job import Job


def follow_to_end(client: Client, job: Job) -> Job:
    """Wait for the end of a job, with a progress bar, and return the job."""
    with progress_bar() as show:

        def show_job(job: Job) -> None:
            if job.progress is not None:
                show(job.progress.stage, job.progress.fraction)
            else:
                show(f"queued, {job.queue_position}." if job.queue_position else "starting", 0.0)

        return client.follow(job, show_job)


def end_with_job(client: Client, job: Job, *, wait: bool, as_json: bool) -> None:
    """Print where a submitted job is, or with `wait` follow it to its end, print that and exit with its code."""
    if not wait:
        print_submitted(client, job, as_json=as_json)
        return
    ended = follow_to_end(client, job)
    print_answer(ended, as_json=as_json)
    raise typer.Exit(job_exit_code(ended))


@contextmanager
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar on a terminal; yields what takes the name of the stage and the fraction that is done."""
    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    columns = (TextColumn("{task.description:<14}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(*columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal) as bar:
        line = bar.add_task("waiting", total=1.0)
        yield lambda stage, fraction: bar.update(line, completed=fraction, description=stage)
