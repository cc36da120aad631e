"""The ST maps of one camera, in a process of its own: JSON on standard input, a zip of two EXR files on its output.

`python -m worker.programs.stmap top-left|bottom-left`. Red and green say where to sample, 0..1; green counts from the
bottom for Nuke and Flame and from the top for Unreal.
"""

from __future__ import annotations

import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from service import lifeline
from service.formats.archive import archive
from service.wire.venue import Camera
from worker.calibration.draw.st_maps import StMap, distorting, undistorting
from worker.jobs.reading import lens_of


def main(origin: str) -> None:
    """Read the camera, write the maps."""
    lifeline.end_with_parent()
    if find_spec("OpenEXR") is None:
        print("ST maps need OpenEXR: pip install 'esc-calibration[exr]'", file=sys.stderr)
        sys.exit(os.EX_UNAVAILABLE)
    camera = Camera.model_validate_json(sys.stdin.buffer.read())
    lens = lens_of(camera.intrinsics, camera.image_size)
    maps = {"undistort": undistorting(lens), "distort": distorting(lens)}
    sys.stdout.buffer.write(archive({f"{name}.exr": _exr(_from(origin, st)) for name, st in maps.items()}))


def _from(origin: str, st: StMap) -> NDArray[np.float32]:
    """Red, green and an empty blue (height, width, 3)."""
    s, t = st[..., 0], st[..., 1]
    return np.stack([s, 1 - t if origin == "bottom-left" else t, np.zeros_like(s)], axis=-1)


def _exr(pixels: NDArray[np.float32]) -> bytes:
    # Of the extra `exr`.
    import OpenEXR

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.exr"
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels)}) as file:
            file.write(str(path))
        return path.read_bytes()


if __name__ == "__main__":
    main(*sys.argv[1:])
