"""Frames and pictures: every file of the service goes through here, into a folder or a bucket."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import timedelta
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Concatenate, ParamSpec, TypeVar, cast
from urllib.parse import unquote, urlparse

import obstore
import structlog
from obstore.exceptions import BaseError, PermissionDeniedError, UnauthenticatedError
from obstore.store import LocalStore, ObjectStore, from_url

from service.secret_files import bucket_credentials

if TYPE_CHECKING:
    from obstore.store import BackoffConfig, ClientConfig, RetryConfig, S3Config


class BlobFolderUnavailable(Exception):  # noqa: N818
    """The folder of the blobs cannot be written or read; the message is that of the operating system."""


class DamagedBlob(Exception):  # noqa: N818
    """An object is empty, or its hash is not the one in its name; the message says which."""


# Errors while a bucket is away or a disk full: trying again later can help.
BLOB_OUTAGES = (BaseError, BlobFolderUnavailable)
# For one answer of a bucket to one request.
ANSWER_S = 30.0
TRUE = ("1", "true", "on", "yes", "y")
# Half an object may be the network's fault: it is read again, after so long each.
AGAIN_S = (0.2, 1.0)
# The hash at the end of an object's path, by which it is known again: SHA-256. Objects of older versions have none.
HASH = re.compile(r"\.([0-9a-f]{64})$")
log = structlog.get_logger()
Arguments = ParamSpec("Arguments")
Returned = TypeVar("Returned")


def _raising_blob_outages(
    method: Callable[Concatenate[Blobs, Arguments], Returned],
) -> Callable[Concatenate[Blobs, Arguments], Returned]:
    """Have a method raise `BlobFolderUnavailable` for what the file system says, by Python or by obstore.

    An `OSError` may be raised by anything else that opens files as well.
    """

    @wraps(method)
    def raising(blobs: Blobs, /, *arguments: Arguments.args, **more: Arguments.kwargs) -> Returned:
        try:
            return method(blobs, *arguments, **more)
        except OSError as error:
            raise BlobFolderUnavailable(str(error)) from error
        except BaseError as error:
            if blobs.is_folder:
                # The lines below say what was tried.
                raise BlobFolderUnavailable(str(error).partition("\n")[0]) from error
            raise

    return raising


class Blobs:
    """Objects by path, in a folder (`file:` URL) or in a bucket (`s3:` URL).

    Whose bucket, and with which credentials, is read from the environment (`AWS_...`) or the files that it names. A
    bucket that does not answer is asked again for `patience_s`: long for who has computed for minutes, short where
    somebody waits for the answer.
    """

    def __init__(self, url: str, patience_s: float = 120.0) -> None:
        parsed = urlparse(url)
        self._folder = Path(unquote(parsed.path)) if parsed.scheme == "file" else None
        self._store: ObjectStore = (
            LocalStore(self._folder, mkdir=True)
            if self._folder
            else from_url(
                url,
                # obstore finds those that stand in no files in the environment.
                config=cast("S3Config", bucket_credentials(os.environ)),
                client_options=_client_options(patience_s),
                retry_config=_retry_options(patience_s),
            )
        )

    @property
    def is_folder(self) -> bool:
        """True for a folder, False for a bucket."""
        return self._folder is not None

    @_raising_blob_outages
    def put(self, path: str, data: bytes) -> None:
        """Store an object; when this returns it survives a crash, of the machine too."""
        # In one piece: of several, those before a crash would stay in the bucket, where no list of objects shows them.
        obstore.put(self._store, path, data, use_multipart=False)
        self._sync_path(path)

    @_raising_blob_outages
    def copy(self, path: str, to: str) -> bool:
        """Copy an object within the store, durable as with `put`; False if there is none."""
        try:
            if self._folder:
                # obstore would link it, which not every file system can.
                (self._folder / to).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self._folder / path, self._folder / to)
            else:
                obstore.copy(self._store, path, to)
        except FileNotFoundError:
            return False
        self._sync_path(to)
        return True

    @_raising_blob_outages
    def move(self, path: str, to: str) -> bool:
        """Move an object, in a folder without copying its bytes; False if there is none.

        In a bucket the object stays where it was as well.
        """
        if self._folder is None:
            return self.copy(path, to)
        try:
            (self._folder / to).parent.mkdir(parents=True, exist_ok=True)
            (self._folder / path).rename(self._folder / to)
        except FileNotFoundError:
            return False
        self._sync_path(to)
        return True

    def _sync_path(self, path: str) -> None:
        if self._folder:
            # A bucket promises durability; a file has it only after its pages have reached the disk, and the entry of
            # each folder on the way to it, of which any may be new.
            place = self._folder / path
            _sync(place)
            for folder in place.parents[: len(Path(path).parts)]:
                _sync(folder)

    @_raising_blob_outages
    def get(self, path: str) -> bytes | None:
        """Return the bytes of an object, or None if there is none."""
        try:
            return obstore.get(self._store, path).bytes().to_bytes()
        except FileNotFoundError:
            return None

    def read(self, path: str, stored_at: str | None = None) -> bytes | None:
        """Return an object that is as it was stored, or None if there is none. Raises `DamagedBlob`.

        `stored_at`: the path that it was stored at, whose hash it has, if it was moved since then.
        """
        pauses_s = [*AGAIN_S]
        while True:
            data = self.get(path)
            damage = None if data is None else _damage(data, stored_at or path)
            if damage is None:
                return data
            log.warning("damaged object", path=path, why=damage)
            if not pauses_s:
                raise DamagedBlob(damage)
            time.sleep(pauses_s.pop(0))

    @_raising_blob_outages
    def has(self, path: str) -> bool:
        """True if the store has an object at this path."""
        try:
            obstore.head(self._store, path)
        except FileNotFoundError:
            return False
        return True

    @_raising_blob_outages
    def delete_under(self, prefix: str) -> None:
        """Remove the folder `prefix` with every object in it."""
        if self._folder:
            # A process that died during a `put` left its beginning here under a name that no list of objects shows.
            with suppress(FileNotFoundError):
                shutil.rmtree(self._folder / prefix)
            return
        for page in obstore.list(self._store, prefix):
            obstore.delete(self._store, [entry["path"] for entry in page])

    def paths(self) -> Iterator[str]:
        """Yield the path of every object."""
        for page in obstore.list(self._store):
            for entry in page:
                yield entry["path"]

    @_raising_blob_outages
    def delete(self, paths: Sequence[str]) -> None:
        """Remove objects."""
        obstore.delete(self._store, paths)

    def check(self) -> None:
        """Raise unless the store answers."""
        if self._folder and not os.access(self._folder, os.W_OK):
            raise PermissionError(f"{self._folder} cannot be written")
        for _ in obstore.list(self._store, "readiness", chunk_size=1):
            break


def outage_text(error: Exception) -> str:
    """Return why one of `BLOB_OUTAGES` was raised, for whoever asked for something.

    What a bucket's server says is for the log alone: it may be of anybody.
    """
    match error:
        case BlobFolderUnavailable():
            return str(error)
        case PermissionDeniedError() | UnauthenticatedError():
            return "the bucket does not take the service's credentials"
        case _:
            return "the bucket does not answer, or not as buckets do"


def _damage(data: bytes, stored_at: str) -> str | None:
    """Return in words what is wrong with an object; None: nothing that can be known."""
    if not data:
        return "it is empty"
    hashed = HASH.search(stored_at)
    if hashed is not None and hashlib.sha256(data).hexdigest() != hashed[1]:
        return f"its {len(data)} bytes are not those that were stored"
    return None


def _client_options(patience_s: float) -> ClientConfig:
    """Return client options whose timeout for one answer of a bucket is at most `patience_s`."""
    # Options given here replace those of the environment, of which this is one.
    plain = os.environ.get("AWS_ALLOW_HTTP", "").lower() in TRUE
    return {"timeout": timedelta(seconds=min(ANSWER_S, patience_s)), "allow_http": plain}


def _retry_options(patience_s: float) -> RetryConfig:
    """Return retry options that repeat a request until `patience_s` is over."""
    pauses: BackoffConfig = {"init_backoff": timedelta(seconds=0.1), "max_backoff": timedelta(seconds=2), "base": 2}
    return {"max_retries": 10_000, "retry_timeout": timedelta(seconds=patience_s), "backoff": pauses}


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
