"""Zip files that are the same bytes for the same content."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

# The earliest that the format knows: the time of writing would make every answer another one.
NO_TIME = (1980, 1, 1, 0, 0, 0)


def archive(files: Mapping[str, bytes]) -> bytes:
    """Files by name, as they are: what is large among them is compressed already."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as content:
        for name, data in files.items():
            content.writestr(zipfile.ZipInfo(name, NO_TIME), data)
    return buffer.getvalue()
