"""The files of jobs in the blob store, for the worker: reads frames, writes pictures."""

from __future__ import annotations

from collections.abc import Mapping

from service.schemas.problems import first_line
from service.settings import Settings
from service.store.blobs import BLOB_OUTAGES, Blobs
from service.store.jobs.files import picture_file, picture_folder
from service.store.jobs.task import Task


class FileUnavailableError(Exception):
    """The blob store cannot read or write a file; the message says why. `camera`: whose file it is, or None."""

    def __init__(self, detail: str, camera: str | None = None) -> None:
        super().__init__(detail)
        self.camera = camera


class JobFiles:
    """Reads and writes the files of jobs, and waits for a bucket that is away: a failure costs minutes of computing."""

    def __init__(self, settings: Settings) -> None:
        self._blobs = Blobs(settings.home_blob_url)

    def frames(self, task: Task) -> dict[str, list[bytes]]:
        """Return the frames of a task by camera, or its photos by name. Raises `FileUnavailableError`."""
        return {camera: [self._frame(camera, path) for path in paths] for camera, paths in task.frames.items()}

    def _frame(self, camera: str, path: str) -> bytes:
        try:
            data = self._blobs.get(path)
        except BLOB_OUTAGES as error:
            raise FileUnavailableError(f"A stored frame cannot be read: {first_line(error)}", camera) from error
        if data is None:
            raise FileUnavailableError(f"The stored frame {path} is gone.", camera)
        return data

    def keep(self, task: Task, pictures: Mapping[str, bytes]) -> None:
        """Store the pictures of an attempt. Raises `FileUnavailableError`."""
        for name, picture in pictures.items():
            try:
                self._blobs.put(f"{picture_folder(task.job_id, task.run_token)}/{picture_file(name)}", picture)
            except BLOB_OUTAGES as error:
                raise FileUnavailableError(f"Its pictures cannot be stored: {first_line(error)}") from error
