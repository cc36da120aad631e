"""What the program that fetches frames from the sources of cameras is asked, and what it answers.

A module of its own: for each fetch a process loads it.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, Field


class SourceTask(BaseModel):
    """What the program reads on its standard input."""

    # By camera: the address as it is shown, and what is secret in it (see SourceSecrets).
    sources: dict[str, tuple[str, str | None]]
    allowed: list[str]
    folder: str
    seconds: float
    most_bytes: int
    most_pixels: int
    # Of each camera, and from the beginning of one to the beginning of the next.
    frames: int = 1
    spacing_s: float = 0.0


class SourceAnswer(BaseModel):
    """A line that it prints for each camera; `why`: a frame is missing. Otherwise all are in their files."""

    camera: str
    why: str | None = None
    seconds: float = Field(0.0, description="That it took, but for the time between frames.")


def frame_file(task: SourceTask, camera: str, number: int) -> Path:
    """Where the program puts a frame of a camera."""
    return Path(task.folder) / f"{camera}.{number}"


def longest_s(task: SourceTask) -> float:
    """After which the program gives up."""
    return task.seconds + (task.frames - 1) * task.spacing_s
