"""Frames from the sources of cameras, fetched by a program of the worker's: one that hangs is ended with it."""

from __future__ import annotations

import os
import subprocess
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

import structlog
from pydantic import BaseModel, ValidationError

from service import lifeline
from service.intake import images
from service.settings import Settings
from service.wire.addresses import HIDDEN
from service.wire.problems import Problem
from service.wire.venue import Camera

# Beyond the time that the sources have: to start, and to encode.
STARTING_S = 10.0
# Of this process: each keeps a thread busy.
AT_ONCE = 8
log = structlog.get_logger()


class SourceTask(BaseModel):
    """What the program reads on its standard input."""

    # By camera: the address, and user and password of it.
    sources: dict[str, tuple[str, str | None]]
    allowed: list[str]
    folder: str
    seconds: float
    most_bytes: int
    most_pixels: int


class SourceAnswer(BaseModel):
    """A line that it prints for each camera; `why`: there is no frame. Otherwise the file of that name is it."""

    camera: str
    why: str | None = None


class Snapshots:
    """Takes frames, of a venue's cameras at once."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._turns = threading.BoundedSemaphore(AT_ONCE)

    def take(self, cameras: Sequence[Camera], credentials: Mapping[str, str]) -> dict[str, bytes]:
        """A checked frame of each camera, by its id. Raises a `Problem` that names the first camera that gave none."""
        for camera in cameras:
            if camera.source is None:
                raise Problem(
                    "missing-camera",
                    f"Send a frame of camera {camera.id}, or give it a source: PUT the venue with one.",
                    camera=camera.id,
                )
        if not self._turns.acquire(blocking=False):
            raise Problem("unavailable", "Other frames are being fetched.", headers={"Retry-After": "5"})
        try:
            with tempfile.TemporaryDirectory(prefix="esc-frames-") as folder:
                answers = self._ask(cameras, credentials, folder)
                return {camera.id: self._checked(camera, answers.get(camera.id), Path(folder)) for camera in cameras}
        finally:
            self._turns.release()

    def _ask(self, cameras: Sequence[Camera], credentials: Mapping[str, str], folder: str) -> dict[str, SourceAnswer]:
        task = SourceTask(
            sources={camera.id: (camera.source or "", credentials.get(camera.id)) for camera in cameras},
            allowed=self._settings.sources,
            folder=folder,
            seconds=self._settings.source_timeout_s,
            most_bytes=int(self._settings.max_frame_mb * 1e6),
            most_pixels=self._settings.max_frame_pixels,
        )
        try:
            done = subprocess.run(
                self._settings.source_program,
                input=task.model_dump_json().encode(),
                env={**os.environ, **self._settings.native_environment, **lifeline.for_child()},
                capture_output=True,
                timeout=self._settings.source_timeout_s + STARTING_S,
            )
            output, errors = done.stdout, done.stderr
        except subprocess.TimeoutExpired as late:
            output, errors = late.stdout or b"", late.stderr or b""
        if errors:
            log.warning("fetching frames", stderr=_without(credentials, errors.decode(errors="replace"))[-2000:])
        return {answer.camera: answer for line in output.splitlines() if (answer := _understood(line))}

    def _checked(self, camera: Camera, answer: SourceAnswer | None, folder: Path) -> bytes:
        if answer is None or answer.why is not None:
            why = answer.why if answer else f"it gave no frame within {self._settings.source_timeout_s:g} s"
            raise Problem(
                "source-failed",
                f"No frame of camera {camera.id} from {camera.source}: {why}.",
                camera=camera.id,
                source=camera.source,
            )
        data = (folder / camera.id).read_bytes()
        images.check(camera, data, self._settings)
        return data


def _without(credentials: Mapping[str, str], text: str) -> str:
    """What native code says may repeat an address whole."""
    for userinfo in credentials.values():
        text = text.replace(userinfo, HIDDEN)
    return text


def _understood(line: bytes) -> SourceAnswer | None:
    try:
        return SourceAnswer.model_validate_json(line)
    except ValidationError:
        return None
