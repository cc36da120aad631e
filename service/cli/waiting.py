"""Waiting for the end of a job of a service, with a progress bar."""

import typer

from service.cli.answers import job_exit_code, print_answer, print_submitted
from service.cli.progress import progress_bar
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
        print_submitted(job, client.url_of(job.links["self"]), as_json=as_json)
        return
    ended = follow_to_end(client, job)
    print_answer(ended, as_json=as_json)
    raise typer.Exit(job_exit_code(ended))
