"""`esc job`: jobs of a service."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import outcome_text, print_answer, print_json
from service.cli.arguments import (
    AnswerAsJson,
    AsJson,
    FormatOption,
    JobId,
    LensOption,
    OneCamera,
    Output,
    Yes,
    check_job_id,
    require_yes,
)
from service.cli.printing import FAILED, USAGE, fail, print_rows, write_document
from service.cli.service_client import ServiceCommands
from service.cli.waiting import end_with_job
from service.client import Client, Refused
from service.schemas.job import Jobs, newest_failed
from service.schemas.names import JobKind, JobStatus
from service.store.jobs.files import picture_file

app = ServiceCommands(
    no_args_is_help=True, help="Jobs of a running service: calibrations, and what comes before the first."
)
NOT_PICTURES = {"self", "events", "cancel", "venue"}


def _check_job_ids(jobs: list[str] | None) -> list[str]:
    return [job for job in jobs or () if check_job_id(job)]


@app.command("list")
def list_jobs(
    client: Client,
    venue: Annotated[str | None, typer.Option(metavar="VENUE", help="Only jobs of this venue.")] = None,
    status: Annotated[JobStatus | None, typer.Option(help="Only jobs in this state.")] = None,
    kind: Annotated[JobKind | None, typer.Option(help="Only jobs of this kind.")] = None,
    limit: Annotated[int, typer.Option(min=1, help="Largest number of jobs.")] = 20,
    as_json: AsJson = False,
) -> None:
    """Print a line per job, newest first: id, time of submission, venue, kind, status, outcome."""
    jobs = client.jobs(venue, status, kind, limit)
    if as_json:
        print_json(Jobs(jobs=jobs))
        return
    rows = [
        (job.id, f"{job.created_at:%Y-%m-%dT%H:%M:%SZ}", job.venue or "-", job.kind, job.status, outcome_text(job))
        for job in jobs
    ]
    print_rows(["JOB", "SUBMITTED", "VENUE", "KIND", "STATUS", "OUTCOME"], rows)


@app.command("get")
def get_job(client: Client, job: JobId, as_json: AnswerAsJson = False) -> None:
    """Print a job."""
    print_answer(client.job(job), as_json=as_json)


@app.command("wait")
def wait_for_job(client: Client, job: JobId, as_json: AnswerAsJson = False) -> None:
    """Follow a job to its end and print it. Exit: 0 accepted, 1 failed or cancelled, 3 rejected, 75 busy."""
    end_with_job(client, client.job(job), wait=True, as_json=as_json)


@app.command("again")
def submit_again(
    client: Client,
    jobs: Annotated[
        list[str] | None,
        typer.Argument(metavar="[JOB...]", callback=_check_job_ids, help="Ids of jobs, as `esc job list` prints them."),
    ] = None,
    failed: Annotated[
        bool, typer.Option("--failed", help="Repeat each venue's newest failed job whose frames are kept.")
    ] = False,
    venue: Annotated[str | None, typer.Option(metavar="VENUE", help="With --failed: only this venue.")] = None,
    wait: Annotated[
        bool, typer.Option("--wait", help="Follow the new job to its end, as `esc job wait` does.")
    ] = False,
    as_json: AnswerAsJson = False,
) -> None:
    """Submit the frames and options of a job once more, as a new job that begins from the poses in use.

    With several jobs, print a line for each: its id, and that of the new job or why there is none.
    Exit: 1 if one was refused.
    """
    if bool(jobs) == failed or (venue and not failed) or (wait and (failed or len(jobs or ()) > 1)):
        fail("Name jobs, or --failed with or without --venue; --wait is for one job", USAGE)
    if jobs and len(jobs) == 1:
        end_with_job(client, client.again(jobs[0]), wait=wait, as_json=as_json)
        return
    ids = jobs or newest_failed(client.jobs(venue, "failed"))
    rows = [_submit_one_again(client, job_id) for job_id in ids]
    if as_json or not sys.stdout.isatty():
        print(
            json.dumps([{"job": job_id, "again": again, "why": why or None} for job_id, again, why in rows], indent=2)
        )
    else:
        print_rows(["JOB", "AGAIN", "WHY NOT"], [(job_id, again or "-", why) for job_id, again, why in rows])
    if any(again is None for _, again, _ in rows):
        raise typer.Exit(FAILED)


def _submit_one_again(client: Client, job_id: str) -> tuple[str, str | None, str]:
    """Return the id of a job, that of the new job, and why there is none."""
    try:
        return job_id, client.again(job_id).id, ""
    except Refused as refused:
        return job_id, None, str(refused)


@app.command("picture")
def picture_of_job(
    client: Client,
    job: JobId,
    picture: Annotated[
        str | None,
        typer.Argument(
            metavar="[PICTURE]",
            help="Name of a picture, such as preview or overlay/left; without it, the names are printed.",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="File to write; default: the picture's name, in this folder.")
    ] = None,
) -> None:
    """Save a picture of a job and print its file; without a name, print the names of all."""
    found = client.job(job)
    names = [name for name in found.links if name not in NOT_PICTURES]
    if picture is None:
        print(*names, sep="\n")
        return
    content = client.picture(found, picture) if picture in names else None
    if content is None:
        fail(f"Job {job} has no picture {picture}; it has {', '.join(names) or 'none'}.", FAILED)
    file = output or Path(picture_file(picture.replace("/", "_")))
    file.write_bytes(content)
    print(file)


@app.command("poses")
def job_poses(
    client: Client,
    job: JobId,
    form: FormatOption = "json",
    camera: OneCamera = None,
    lens: LensOption = "stored",
    output: Output = None,
) -> None:
    """Write the poses that a job found in the format of another tool."""
    write_document(client.job_poses(job, form, camera, lens), output)


@app.command("accept")
def accept_job(client: Client, job: JobId, camera: OneCamera = None, as_json: AnswerAsJson = False) -> None:
    """Store the poses of a job that the gate rejected or that was a dry run; confirm those of an accepted one."""
    print_answer(client.accept(job, camera), as_json=as_json, with_outcome=False)


@app.command("reject")
def reject_job(client: Client, job: JobId, as_json: AnswerAsJson = False) -> None:
    """Restore the poses from before a job."""
    print_answer(client.reject(job), as_json=as_json, with_outcome=False)


@app.command("cancel")
def cancel_job(client: Client, job: JobId, as_json: AnswerAsJson = False) -> None:
    """End a job that is still open."""
    print_answer(client.cancel(job), as_json=as_json, with_outcome=False)


@app.command("delete")
def delete_job(client: Client, job: JobId, yes: Yes = False) -> None:
    """Forget a job that has ended, with its frames and pictures. Poses that it brought to its venue stay."""
    require_yes(yes, f"Forget job {job}, its frames and its pictures")
    client.delete_job(job)
