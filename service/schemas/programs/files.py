"""Messages of programs: a line of JSON, followed by files."""

from collections.abc import Mapping
from typing import Self

from pydantic import BaseModel


class ProgramMessage(BaseModel):
    """Message of a program; `sizes`: bytes of the files that follow, by their names."""

    sizes: dict[str, int] = {}

    @classmethod
    def decode(cls, data: bytes) -> tuple[Self, dict[str, bytes]]:
        """Return a message and its files by their names."""
        line, _, files = data.partition(b"\n")
        message = cls.model_validate_json(line)
        return message, split_files(files, message.sizes)

    def encode(self, files: Mapping[str, bytes]) -> bytes:
        """Return the message with files."""
        message = self.model_copy(update={"sizes": {name: len(file) for name, file in files.items()}})
        return b"".join((message.model_dump_json().encode(), b"\n", *files.values()))


def split_files(data: bytes | bytearray, sizes: Mapping[str, int]) -> dict[str, bytes]:
    """Split concatenated files by their `sizes` in bytes; return them by name."""
    files, begin = {}, 0
    for name, size in sizes.items():
        files[name], begin = bytes(data[begin : begin + size]), begin + size
    return files
