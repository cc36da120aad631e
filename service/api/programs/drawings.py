"""Pictures of calibrations, drawn when somebody first looks at them, and kept.

A program draws them, beside this process: frames are what strangers sent, and decoding and blending them here would
hold up every other request. Several API processes may draw the same picture at once: it is the same, and stored under
the same name.
"""

import asyncio
from contextlib import suppress
from weakref import WeakValueDictionary

from starlette.concurrency import run_in_threadpool

from service.api.programs.program_pool import ProgramPool, turn_of
from service.schemas.programs.drawing import DrawingRequest
from service.schemas.programs.files import ProgramMessage
from service.settings import Settings
from service.store.blobs import Blobs, DamagedBlob
from service.store.jobs.files import drawn_together, picture_file, pictures_folder, source_file
from service.store.jobs.queries import Drawable, JobRepository, Pictures

LONGEST_S = 60.0


class Drawings:
    """Draws pictures of jobs by a program, `ESC_PICTURES_AT_ONCE` of them at once."""

    def __init__(self, settings: Settings, jobs: JobRepository, blobs: Blobs) -> None:
        self._threads, self._jobs, self._blobs = settings.threads, jobs, blobs
        self._pool = ProgramPool(
            "picture",
            settings.picture_program,
            settings.native_environment,
            LONGEST_S,
            at_once=settings.pictures_at_once,
        )
        # One for each set of pictures that are drawn together, so that nobody else draws it meanwhile.
        self._drawing: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    async def picture(self, job_id: str, pictures: Pictures, name: str) -> bytes | None:
        """Return the file of a picture of a job, drawn if it is not there; None if it cannot be drawn any more."""
        stored = await run_in_threadpool(self._stored, pictures, name)
        together = drawn_together(name)
        if stored is not None or not together:
            return stored
        lock = self._drawing.setdefault(f"{job_id}/{together[0]}", asyncio.Lock())
        async with turn_of(lock):
            stored = await run_in_threadpool(self._stored, pictures, name)
            if stored:
                return stored
            async with self._pool.turn():
                return await run_in_threadpool(self._draw, job_id, pictures, name)

    def _draw(self, job_id: str, pictures: Pictures, name: str) -> bytes | None:
        job = self._jobs.drawable(job_id)
        frames = {} if job is None else self._frames(job, pictures, name)
        if job is None or None in frames.values():
            return None
        files = {camera: frame for camera, frame in frames.items() if frame is not None}
        asked = DrawingRequest.of(job.venue, job.result, drawn_together(name), self._threads)
        _, drawn = ProgramMessage.decode(self._pool.run_in_this_thread(asked.encode(files)))
        for each, picture in drawn.items():
            self._blobs.put(f"{pictures.folder}/{picture_file(each)}", picture)
        self._forget_if_gone(job_id)
        return drawn.get(name)

    def _frames(self, job: Drawable, pictures: Pictures, name: str) -> dict[str, bytes | None]:
        """Return the frames of the cameras that a picture shows, None for those that are gone."""
        camera = name.partition("_")[2]
        needed = [camera] if camera in job.frames and f"frame_{camera}" in drawn_together(name) else job.frames
        return {one: drawable_frame(self._blobs, job.frames[one], pictures.folder, one) for one in needed}

    def _forget_if_gone(self, job_id: str) -> None:
        """Delete pictures whose job was deleted while they were drawn: retention does not come again."""
        pictures = self._jobs.pictures(job_id)
        if pictures is None or pictures.deleted:
            self._blobs.delete_under(pictures_folder(job_id))

    def _stored(self, pictures: Pictures, name: str) -> bytes | None:
        """Return the stored file of a picture; None if there is none, or it is damaged and may be drawn again."""
        with suppress(DamagedBlob):
            return self._blobs.read(f"{pictures.folder}/{picture_file(name)}")
        return None


def drawable_frame(blobs: Blobs, path: str, pictures_folder: str, camera: str) -> bytes | None:
    """Return the frame of a camera that pictures are drawn of, from its own path or what was kept of it.

    None if it is gone, or is not what was stored.
    """
    for place in (path, source_file(pictures_folder, camera)):
        with suppress(DamagedBlob):
            if frame := blobs.read(place, stored_at=path):
                return frame
    return None
