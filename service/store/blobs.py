"""Frames and pictures: every file of the service goes through here, into a folder or a bucket."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlparse

import obstore
from obstore.exceptions import BaseError
from obstore.store import LocalStore, ObjectStore, from_url

if TYPE_CHECKING:
    from obstore.store import BackoffConfig, ClientConfig, RetryConfig


class FolderAway(Exception):  # noqa: N818
    """The folder of the files cannot be written or read, the machine says why."""


# What is raised while a bucket is away, or a disk full: trying again later can help.
AWAY = (BaseError, FolderAway)
# For one answer of a bucket to one request.
ANSWER_S = 30.0
TRUE = ("1", "true", "on", "yes", "y")


@contextmanager
def _told() -> Iterator[None]:
    """The machine's errors are told apart from those of anything else that opens files or starts programs."""
    try:
        yield
    except OSError as error:
        raise FolderAway(str(error)) from error


class Blobs:
    """Objects by path, in a folder (`file:` URL) or in a bucket (`s3:` URL).

    Whose bucket, and with which credentials, is read from the environment (`AWS_...`). A bucket that does not answer is
    asked again for `patience_s`: long for who has computed for minutes, short where somebody waits for the answer.
    """

    def __init__(self, url: str, patience_s: float = 120.0) -> None:
        parsed = urlparse(url)
        self._folder = Path(unquote(parsed.path)) if parsed.scheme == "file" else None
        self._store: ObjectStore = (
            LocalStore(self._folder, mkdir=True)
            if self._folder
            else from_url(url, client_options=_within(patience_s), retry_config=_for(patience_s))
        )

    @_told()
    def put(self, path: str, data: bytes) -> None:
        """Store an object; when this returns it survives a crash, of the machine too."""
        # In one piece: of several, those before a crash would stay in the bucket, where no list of objects shows them.
        obstore.put(self._store, path, data, use_multipart=False)
        self._make_sure_of(path)

    @_told()
    def copy(self, path: str, to: str) -> bool:
        """Store an object a second time, as `put` does, without its bytes coming here; False if there is none."""
        try:
            if self._folder:
                # obstore would link it, which not every file system can.
                (self._folder / to).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self._folder / path, self._folder / to)
            else:
                obstore.copy(self._store, path, to)
        except FileNotFoundError:
            return False
        self._make_sure_of(to)
        return True

    @_told()
    def move(self, path: str, to: str) -> bool:
        """Let an object be found elsewhere; in a folder that takes no room. False if there is none.

        In a bucket the object stays where it was as well.
        """
        if self._folder is None:
            return self.copy(path, to)
        try:
            (self._folder / to).parent.mkdir(parents=True, exist_ok=True)
            (self._folder / path).rename(self._folder / to)
        except FileNotFoundError:
            return False
        self._make_sure_of(to)
        return True

    def _make_sure_of(self, path: str) -> None:
        if self._folder:
            # A bucket promises durability; a file has it only after its pages have reached the disk, and the entry of
            # each folder on the way to it, of which any may be new.
            place = self._folder / path
            _sync(place)
            for folder in place.parents[: len(Path(path).parts)]:
                _sync(folder)

    @_told()
    def get(self, path: str) -> bytes | None:
        """An object, or None if there is none."""
        try:
            return obstore.get(self._store, path).bytes().to_bytes()
        except FileNotFoundError:
            return None

    @_told()
    def has(self, path: str) -> bool:
        """Whether there is such an object."""
        try:
            obstore.head(self._store, path)
        except FileNotFoundError:
            return False
        return True

    @_told()
    def delete_under(self, prefix: str) -> None:
        """Remove the folder `prefix` with every object in it."""
        if self._folder:
            # Whoever died over a `put` left its beginning here under another name, which no list of objects shows.
            with suppress(FileNotFoundError):
                shutil.rmtree(self._folder / prefix)
            return
        for page in obstore.list(self._store, prefix):
            obstore.delete(self._store, [entry["path"] for entry in page])

    def check(self) -> None:
        """Raise unless the store answers."""
        if self._folder and not os.access(self._folder, os.W_OK):
            raise PermissionError(f"{self._folder} cannot be written")
        for _ in obstore.list(self._store, "readiness", chunk_size=1):
            break


def _within(patience_s: float) -> ClientConfig:
    """A bucket that takes a request and then says nothing uses up no more patience than there is."""
    # Options given here replace those of the environment, of which this is one.
    plain = os.environ.get("AWS_ALLOW_HTTP", "").lower() in TRUE
    return {"timeout": timedelta(seconds=min(ANSWER_S, patience_s)), "allow_http": plain}


def _for(patience_s: float) -> RetryConfig:
    """Ask again until the time is over, however often that is."""
    pauses: BackoffConfig = {"init_backoff": timedelta(seconds=0.1), "max_backoff": timedelta(seconds=2), "base": 2}
    return {"max_retries": 10_000, "retry_timeout": timedelta(seconds=patience_s), "backoff": pauses}


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
