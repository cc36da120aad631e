"""Pictures of calibrations, drawn when somebody first looks at them, and kept.

A program draws them, beside this process: frames are what strangers sent, and decoding and blending them here would
hold up every other request. A few at a time; who waits for a turn holds no thread. Several API processes may draw the
same picture at once: it is the same, and stored under the same name.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from weakref import WeakValueDictionary

from starlette.concurrency import run_in_threadpool

from service.api.programs.running import run_program
from service.schemas.problems import Problem
from service.schemas.programs.drawing import DrawingRequest, DrawnPictures, decode_files, encode_message
from service.settings import Settings
from service.store.blobs import Blobs, DamagedBlob
from service.store.jobs.files import drawn_together, picture_file, pictures_folder, source_file
from service.store.jobs.queries import Drawable, JobRepository, Pictures

LONGEST_S = 60.0
# The first picture takes about a second, and a page asks for several at once.
PATIENCE_S = 20.0
AGAIN_S = 2


class Drawings:
    """Asks the program that draws them, for so many at once."""

    def __init__(self, settings: Settings, jobs: JobRepository, blobs: Blobs) -> None:
        self._settings, self._jobs, self._blobs = settings, jobs, blobs
        self._turns = asyncio.Semaphore(settings.pictures_at_once)
        # Of pictures that are drawn together: whoever asks for one while they are drawn waits for them.
        self._drawing: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    async def picture(self, job_id: str, pictures: Pictures, name: str) -> bytes | None:
        """The file of a picture of a job, drawn if it is not there; None if it cannot be drawn any more."""
        stored = await run_in_threadpool(self._stored, pictures, name)
        together = drawn_together(name)
        if stored is not None or not together:
            return stored
        lock = self._drawing.setdefault(f"{job_id}/{together[0]}", asyncio.Lock())
        async with turn_of(lock):
            stored = await run_in_threadpool(self._stored, pictures, name)
            if stored:
                return stored
            async with turn_of(self._turns):
                return await run_in_threadpool(self._draw, job_id, pictures, name)

    def _draw(self, job_id: str, pictures: Pictures, name: str) -> bytes | None:
        job = self._jobs.drawable(job_id)
        frames = {} if job is None else self._frames(job, pictures, name)
        if job is None or None in frames.values():
            return None
        files = {camera: frame for camera, frame in frames.items() if frame is not None}
        asked = DrawingRequest.of(job.venue, job.result, [name], self._settings.threads, files)
        program, environment = self._settings.picture_program, self._settings.native_environment
        said = run_program("picture", program, environment, encode_message(asked, files), LONGEST_S)
        drawn = decode_files(DrawnPictures.model_validate_json(said[: said.index(b"\n")]).sizes, said)
        for each, picture in drawn.items():
            self._blobs.put(f"{pictures.folder}/{picture_file(each)}", picture)
        self._forget_if_gone(job_id)
        return drawn.get(name)

    def _frames(self, job: Drawable, pictures: Pictures, name: str) -> dict[str, bytes | None]:
        """Of the cameras that a picture shows; from their own folder, or what was kept of it."""
        of_one = name.partition("_")[2]
        needed = [of_one] if of_one in job.frames and f"frame_{of_one}" in drawn_together(name) else job.frames
        return {camera: drawable_frame(self._blobs, job.frames[camera], pictures.folder, camera) for camera in needed}

    def _forget_if_gone(self, job_id: str) -> None:
        """Who tidied up while they were drawn does not come again."""
        left = self._jobs.pictures(job_id)
        if left is None or left.deleted:
            self._blobs.delete_under(pictures_folder(job_id))

    def _stored(self, pictures: Pictures, name: str) -> bytes | None:
        """The file of a picture; one that is damaged is as good as none, and may be drawn again."""
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


@asynccontextmanager
async def turn_of(
    turn: asyncio.Lock | asyncio.Semaphore, why: str = "Other pictures are being drawn."
) -> AsyncIterator[None]:
    """In one's turn, if it comes soon; who has waited long is told why, and to come again."""
    try:
        async with asyncio.timeout(PATIENCE_S):
            await turn.acquire()
    except TimeoutError:
        headers = {"Retry-After": str(AGAIN_S)}
        raise Problem("unavailable", why, headers=headers) from None
    try:
        yield
    finally:
        turn.release()
