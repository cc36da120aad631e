"""EXR files; they need the package's extra `exr`."""

import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from service import build


def end_without_openexr() -> None:
    """Say what to install where it is missing."""
    if find_spec("OpenEXR") is None:
        # Whoever asks the service reads it: not where its Python lies.
        print(f"ST maps need OpenEXR, which `{build.install_command('exr')}` brings to the service", file=sys.stderr)
        sys.exit(os.EX_UNAVAILABLE)


def exr(channels: Literal["RGB", "RGBA"], pixels: NDArray[np.float32]) -> bytes:
    """A file of pixels (height, width, channels)."""
    import OpenEXR

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.exr"
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {channels: np.ascontiguousarray(pixels)}) as file:
            file.write(str(path))
        return path.read_bytes()
