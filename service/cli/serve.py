"""`esc up`, `serve` and `worker`: a service, or a part of one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service import confinement
from service.cli.arguments import Data, Host, Port, load_settings
from service.cli.printing import FAILED, USAGE, fail

if TYPE_CHECKING:
    from service.settings import Settings


def up(data: Data = None, host: Host = None, port: Port = None) -> None:
    """Run the whole service on this machine: API, operator's page and one worker, with nothing else beside them."""
    confinement.hide_memory()
    _serve(load_settings(data=data, host=host, port=port), with_worker=True)


def serve(data: Data = None, host: Host = None, port: Port = None) -> None:
    """Run the API and the operator's page alone; `esc worker` computes, here or on other machines."""
    confinement.hide_memory()
    _serve(load_settings(data=data, host=host, port=port), with_worker=False)


def worker(
    data: Data = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--name",
            help="A name that no other worker has, the same after a restart (ESC_WORKER_NAME) [default: the host's]",
        ),
    ] = None,
) -> None:
    """Run a worker alone: it computes the jobs of a service whose database and files its settings name."""
    confinement.hide_memory()
    from service.worker_lock import AlreadyRunning
    from worker import supervisor

    try:
        settings = load_settings(data=data, worker_name=name)
        with report_database_errors(settings, with_worker=True):
            supervisor.run(settings)
    except AlreadyRunning as error:
        fail(str(error), USAGE)


def _serve(settings: Settings, *, with_worker: bool) -> None:
    from service import serving
    from service.worker_lock import AlreadyRunning

    try:
        with report_database_errors(settings, with_worker=with_worker):
            serving.serve(settings, with_worker=with_worker)
    except (serving.CannotListen, AlreadyRunning) as error:
        fail(str(error), USAGE)


def _check_database_place(settings: Settings) -> None:
    from service.store.database import require_local_file

    if not settings.sqlite_on_network:
        require_local_file(settings.home_database_url)


@contextmanager
def report_database_errors(settings: Settings | None = None, *, with_worker: bool = False) -> Iterator[None]:
    """What is wrong with the database is a line: it is wrong at the start, or not of this program's making.

    `settings`: of the service that is about to be used, whose database must be local and whose folders must be
    writable.
    """
    import sqlalchemy as sa

    from service.store.database import UnsupportedDatabase

    try:
        if settings is not None:
            # First: on a network, not even a folder is made.
            _check_database_place(settings)
            _require_folders(settings, with_worker=with_worker)
        yield
    except UnsupportedDatabase as error:
        fail(str(error), USAGE)
    except sa.exc.DBAPIError as error:
        url = settings and settings.home_database_url
        # SQLite does not say which file it cannot open.
        which = f" {url.removeprefix('sqlite:///')}" if url and url.startswith("sqlite:///") else ""
        fail(f"The database{which} cannot be used: {error.orig}", FAILED)


def _require_folders(settings: Settings, *, with_worker: bool) -> None:
    """End where a folder that the service writes to cannot be made or written."""
    folders = {}
    if settings.database_url is not None and settings.database_url.startswith("sqlite:///"):
        folders["ESC_DATABASE_URL"] = Path(settings.database_url.removeprefix("sqlite:///")).parent
    # A worker locks its name there, wherever database and files are.
    if with_worker or settings.database_url is None:
        folders["--data (ESC_DATA)"] = settings.data
    for setting, folder in folders.items():
        why = _why_unwritable(folder)
        if why is not None:
            fail(f"The data folder {folder} cannot be written: {why}. {setting} names another.", FAILED)


def _why_unwritable(folder: Path) -> str | None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        return "it is a file"
    except OSError as error:
        return f"{error.filename}: {error.strerror}" if error.filename != str(folder) else error.strerror
    return None if os.access(folder, os.W_OK | os.X_OK) else "this user has no right to"
