"""What the program that draws pictures is asked, and what it answers: a line of JSON each, and files behind it."""

from __future__ import annotations

from pydantic import BaseModel

from service.wire.results import Result
from service.wire.venue import Venue


class Drawing(BaseModel):
    """Pictures of a calibration, from the `venue` as the job found it and its `result`.

    `names`: of the pictures; `sizes`: bytes of the frames that follow, one of each camera that is needed.
    """

    venue: Venue
    result: Result
    names: list[str]
    threads: int
    sizes: dict[str, int]


class Drawn(BaseModel):
    """The pictures that follow, and their bytes; one that cannot be drawn is missing."""

    sizes: dict[str, int]


def packed(told: Drawing | Drawn, files: dict[str, bytes]) -> bytes:
    """The line and the files."""
    return b"".join((told.model_dump_json().encode(), b"\n", *files.values()))


def unpacked(sizes: dict[str, int], data: bytes) -> dict[str, bytes]:
    """The files behind the line."""
    files, begin = {}, data.index(b"\n") + 1
    for name, size in sizes.items():
        files[name], begin = data[begin : begin + size], begin + size
    return files
