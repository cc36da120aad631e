"""The database and the folders of a service on this machine: checks before they are used."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

from service.cli.printing import FAILED, USAGE, fail
from service.settings import Settings
from service.store.database import UnsupportedDatabase, require_local_file
from service.worker_lock import AlreadyRunning


@contextmanager
def prepared_home(settings: Settings, *, with_worker: bool) -> Iterator[None]:
    """Make database and folders ready for the block that uses them; exit with a line where that fails."""
    try:
        with report_database_errors(settings):
            if not settings.sqlite_on_network:
                require_local_file(settings.home_database_url)
            require_folders(settings, with_worker=with_worker)
            yield
    except AlreadyRunning as error:
        fail(str(error), USAGE)


@contextmanager
def report_database_errors(settings: Settings | None = None) -> Iterator[None]:
    """Exit with a line where a database cannot be used; `settings`: those of its service, to name its file."""
    try:
        yield
    except UnsupportedDatabase as error:
        fail(str(error), USAGE)
    except sa.exc.DBAPIError as error:
        url = settings and settings.home_database_url
        # SQLite does not say which file it cannot open.
        which = f" {url.removeprefix('sqlite:///')}" if url and url.startswith("sqlite:///") else ""
        fail(f"The database{which} cannot be used: {error.orig}", FAILED)


def require_folders(settings: Settings, *, with_worker: bool = False) -> None:
    """Make the folders that a service writes to; exit where one cannot be made or written."""
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
