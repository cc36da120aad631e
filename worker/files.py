"""The files of jobs in the store, for those who compute them: frames out of it, pictures into it."""

from __future__ import annotations

from collections.abc import Mapping

from service.settings import Settings
from service.store.blobs import AWAY, Blobs
from service.store.jobs.files import picture_file, picture_folder
from service.store.jobs.task import Task
from service.wire.problems import first_line


class NotStored(Exception):  # noqa: N818
    """The store does not hand out or take a file; says why, and the camera it is about."""

    def __init__(self, detail: str, camera: str | None = None) -> None:
        super().__init__(detail)
        self.camera = camera


class JobFiles:
    """Patient with a bucket that is away: what it may cost otherwise is minutes of computing."""

    def __init__(self, settings: Settings) -> None:
        self._blobs = Blobs(settings.home_blob_url)

    def frames(self, task: Task) -> dict[str, list[bytes]]:
        """The frames by camera, photos by their names. Raises `NotStored`."""
        return {camera: [self._frame(camera, path) for path in paths] for camera, paths in task.frames.items()}

    def _frame(self, camera: str, path: str) -> bytes:
        try:
            data = self._blobs.get(path)
        except AWAY as error:
            raise NotStored(f"A stored frame cannot be read: {first_line(error)}", camera) from error
        if data is None:
            raise NotStored(f"The stored frame {path} is gone.", camera)
        return data

    def keep(self, task: Task, pictures: Mapping[str, bytes]) -> None:
        """Store the pictures of an attempt. Raises `NotStored`."""
        for name, picture in pictures.items():
            try:
                self._blobs.put(f"{picture_folder(task.job_id, task.run_token)}/{picture_file(name)}", picture)
            except AWAY as error:
                raise NotStored(f"Its pictures cannot be stored: {first_line(error)}") from error
