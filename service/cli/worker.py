"""`esc worker`: what computes the jobs of a service."""

from typing import Annotated

import typer

from service import confinement
from service.cli.arguments import Data
from service.cli.local_database import prepared_home
from service.cli.service_settings import load_settings
from worker import supervisor


def worker(
    data: Data = None,
    name: Annotated[
        str | None,
        typer.Option(
            help="Name of the worker, unique and the same after a restart (ESC_WORKER_NAME) [default: the host's]"
        ),
    ] = None,
) -> None:
    """Run a worker alone: it computes the jobs of a service whose database and files its settings name."""
    confinement.hide_memory()
    settings = load_settings(data=data, worker_name=name)
    with prepared_home(settings, with_worker=True):
        supervisor.run(settings)
