"""`esc job`: jobs of a service."""

from __future__ import annotations

import typer

from service.cli.arguments import LOCAL, ApiKey, Form, OneCamera, Output, Url
from service.cli.printing import hand_out, say
from service.client import Client

app = typer.Typer(no_args_is_help=True, help="Jobs of a running service.")


@app.command("poses")
def job_poses(
    job: str,
    form: Form = "json",
    camera: OneCamera = None,
    output: Output = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Write the poses that a job found in the format of another tool."""
    with Client(url, api_key) as client:
        hand_out(client.job_poses(job, form, camera), output)


@app.command("accept")
def accept_job(job: str, camera: OneCamera = None, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Let the poses of a job hold that the gate rejected, or that was a dry run."""
    with Client(url, api_key) as client:
        say(client.accept(job, camera))


@app.command("reject")
def reject_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Put back the poses that held before those of a job."""
    with Client(url, api_key) as client:
        say(client.reject(job))


@app.command("get")
def get_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a job."""
    with Client(url, api_key) as client:
        say(client.job(job))


@app.command("cancel")
def cancel_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """End a job that is still open."""
    with Client(url, api_key) as client:
        say(client.cancel(job))
