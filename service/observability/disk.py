"""Room on the disk: of the folders that the database and the files grow in, where those are on this machine."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from urllib.parse import unquote, urlparse

import sqlalchemy as sa

from service.settings import Settings


class Disk:
    """What is left of it. With a bucket and PostgreSQL there is nothing to watch, and always room."""

    def __init__(self, settings: Settings) -> None:
        self._folders = _growing(settings)
        self.min_free_bytes = int(settings.min_free_mb * 1e6)

    def free_bytes(self) -> int | None:
        """What is free where least is; None if nothing grows here."""
        return min((shutil.disk_usage(folder).free for folder in self._folders), default=None)

    def is_short(self) -> bool:
        """Whether less is free than must be."""
        free = self.free_bytes()
        return free is not None and free < self.min_free_bytes


def spool_folder() -> Path:
    """Where the files of an upload lie while it arrives."""
    return Path(tempfile.gettempdir())


def spool_free_bytes() -> int:
    """What is free there."""
    return shutil.disk_usage(spool_folder()).free


def _growing(settings: Settings) -> list[Path]:
    folders = []
    files, database = urlparse(settings.home_blob_url), sa.make_url(settings.home_database_url)
    if files.scheme == "file":
        folders.append(Path(unquote(files.path)))
    if database.get_backend_name() == "sqlite" and database.database:
        folders.append(Path(database.database).absolute().parent)
    return folders
