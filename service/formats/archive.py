"""Zip files that are the same bytes for the same content."""

import io
import zipfile
from collections.abc import Mapping, Sequence

# The earliest that the format knows: the time of writing would make every answer another one.
NO_TIME = (1980, 1, 1, 0, 0, 0)


def archive(files: Mapping[str, bytes], *, compressed: bool = False, executable: Sequence[str] = ()) -> bytes:
    """Return a zip of files by their names, stored as they are or `compressed` quickly."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as content:
        for name, data in files.items():
            about = zipfile.ZipInfo(name, NO_TIME)
            about.external_attr = (0o755 if name in executable else 0o644) << 16
            content.writestr(about, data, zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED, compresslevel=1)
    return buffer.getvalue()
