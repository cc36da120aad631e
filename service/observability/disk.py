"""Free disk space of the local folders in which database and files grow."""

import shutil
import tempfile
from pathlib import Path
from urllib.parse import unquote, urlparse

import sqlalchemy as sa

from service.settings import Settings


class Disk:
    """Free space for database and files. With PostgreSQL and a bucket there is no local folder to watch."""

    def __init__(self, settings: Settings) -> None:
        self._folders = _growing(settings)
        self.min_free_bytes = int(settings.min_free_mb * 1e6)

    def free_bytes(self) -> int | None:
        """Return the free bytes of the fullest folder; None without local folders."""
        return min((shutil.disk_usage(folder).free for folder in self._folders), default=None)

    def is_short(self) -> bool:
        """True if less is free than the setting demands."""
        free = self.free_bytes()
        return free is not None and free < self.min_free_bytes


def spool_folder() -> Path:
    """Return the folder of files of uploads that are arriving."""
    return Path(tempfile.gettempdir())


def spool_free_bytes() -> int:
    """Return the free bytes for arriving uploads."""
    return shutil.disk_usage(spool_folder()).free


def _growing(settings: Settings) -> list[Path]:
    folders = []
    files, database = urlparse(settings.home_blob_url), sa.make_url(settings.home_database_url)
    if files.scheme == "file":
        folders.append(Path(unquote(files.path)))
    if database.get_backend_name() == "sqlite" and database.database:
        folders.append(Path(database.database).absolute().parent)
    return folders
