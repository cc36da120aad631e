"""Files that lie one behind the other in what a program is given or says; a line before them tells their sizes."""

from __future__ import annotations

from collections.abc import Mapping


def split_files(data: bytes | bytearray, sizes: Mapping[str, int]) -> dict[str, bytes]:
    """The files by their names, from their `sizes` in bytes."""
    files, begin = {}, 0
    for name, size in sizes.items():
        files[name], begin = bytes(data[begin : begin + size]), begin + size
    return files
