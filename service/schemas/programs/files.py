"""Concatenated files in a message of a program, whose first line has their sizes."""

from collections.abc import Mapping


def split_files(data: bytes | bytearray, sizes: Mapping[str, int]) -> dict[str, bytes]:
    """Split concatenated files by their `sizes` in bytes; return them by name."""
    files, begin = {}, 0
    for name, size in sizes.items():
        files[name], begin = bytes(data[begin : begin + size]), begin + size
    return files
