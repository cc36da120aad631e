"""Request and answer of the program that fetches frames from the sources of cameras.

Imports little: each fetch starts a process that loads this module.
"""

from pathlib import Path

from pydantic import BaseModel, Field


class SourceTask(BaseModel):
    """Request of a fetch, on the program's standard input."""

    # By camera: the address without secrets, and the encoded secrets (see SourceSecrets).
    sources: dict[str, tuple[str, str | None]]
    allowed: list[str]
    folder: str
    seconds: float
    most_bytes: int
    most_pixels: int
    # Frames of each camera, and the time from one to the next.
    frames: int = 1
    spacing_s: float = 0.0


class SourceAnswer(BaseModel):
    """Answer for one camera, a line of the program's output; `why`: reason of a missing frame, None if all came."""

    camera: str
    why: str | None = None
    seconds: float = Field(0.0, description="Duration of the fetch without the time between frames.")


def frame_file(task: SourceTask, camera: str, number: int) -> Path:
    """Return the file that the program writes a frame of a camera to."""
    return Path(task.folder) / f"{camera}.{number}"


def longest_s(task: SourceTask) -> float:
    """Return the time after which the program gives up, seconds."""
    return task.seconds + (task.frames - 1) * task.spacing_s
