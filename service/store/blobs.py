"""Frames and pictures: every file of the service goes through here, into a folder or a bucket."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote, urlparse

import obstore
from obstore.store import LocalStore, ObjectStore, from_url


class Blobs:
    """Objects by path, in a folder (`file:` URL) or in what else obstore can reach (`s3:`)."""

    def __init__(self, url: str) -> None:
        parsed = urlparse(url)
        self._folder = Path(unquote(parsed.path)) if parsed.scheme == "file" else None
        self._store: ObjectStore = (
            LocalStore(self._folder, mkdir=True, automatic_cleanup=True) if self._folder else from_url(url)
        )

    def put(self, path: str, data: bytes) -> None:
        """Store an object; when this returns it survives a crash, of the machine too."""
        obstore.put(self._store, path, data)
        if self._folder:
            # A bucket promises durability; a file has it only after its pages have reached the disk, and the entry of
            # each folder on the way to it, of which any may be new.
            place = self._folder / path
            _sync(place)
            for folder in place.parents[: len(Path(path).parts)]:
                _sync(folder)

    def get(self, path: str) -> bytes | None:
        """An object, or None if there is none."""
        try:
            return obstore.get(self._store, path).bytes().to_bytes()
        except FileNotFoundError:
            return None

    def delete_under(self, prefix: str) -> None:
        """Remove every object whose path begins with the folder `prefix`."""
        for page in obstore.list(self._store, prefix):
            obstore.delete(self._store, [entry["path"] for entry in page])

    def check(self) -> None:
        """Raise unless the store answers."""
        if self._folder and not os.access(self._folder, os.W_OK):
            raise PermissionError(f"{self._folder} cannot be written")
        for _ in obstore.list(self._store, "readiness", chunk_size=1):
            break


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
