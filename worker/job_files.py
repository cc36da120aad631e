"""Files of jobs in the blob store: reads frames, writes pictures."""

from collections.abc import Mapping

import structlog

from service.settings import Settings
from service.store.blobs import BLOB_OUTAGES, Blobs, DamagedBlob, outage_text
from service.store.jobs.files import picture_file, picture_folder
from service.store.jobs.task import Task

log = structlog.get_logger()


class FileUnavailableError(Exception):
    """The blob store cannot read or write a file; the message says why, `kind` which problem that is of a job.

    `camera`: whose file it is, or None.
    """

    def __init__(self, detail: str, camera: str | None = None, kind: str = "job-crashed") -> None:
        super().__init__(detail)
        self.camera = camera
        self.kind = kind


class JobFiles:
    """Reads and writes the files of jobs, and waits for a bucket that is away: a failure costs minutes of computing."""

    def __init__(self, settings: Settings) -> None:
        self._blobs = Blobs(settings.home_blob_url)

    def frames(self, task: Task) -> dict[str, list[bytes]]:
        """Return the frames of a task by camera, or its photos by name. Raises `FileUnavailableError`."""
        return {camera: [self._frame(camera, path) for path in paths] for camera, paths in task.frames.items()}

    def _frame(self, camera: str, path: str) -> bytes:
        try:
            data = self._blobs.read(path)
        except DamagedBlob as error:
            detail = f"The stored frame of {camera} was damaged in the store: {error}. Send it again."
            raise FileUnavailableError(detail, camera, "broken-image") from error
        except BLOB_OUTAGES as error:
            log.warning("a stored frame cannot be read", path=path, exc_info=True)
            raise FileUnavailableError(f"A stored frame cannot be read: {outage_text(error)}", camera) from error
        if data is None:
            raise FileUnavailableError(f"The stored frame {path} is gone.", camera)
        return data

    def keep(self, task: Task, pictures: Mapping[str, bytes]) -> None:
        """Store the pictures of an attempt. Raises `FileUnavailableError`."""
        for name, picture in pictures.items():
            try:
                self._blobs.put(f"{picture_folder(task.job_id, task.run_token)}/{picture_file(name)}", picture)
            except BLOB_OUTAGES as error:
                log.warning("a picture cannot be stored", picture=name, exc_info=True)
                raise FileUnavailableError(f"Its pictures cannot be stored: {outage_text(error)}") from error
