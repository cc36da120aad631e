"""The ST maps of one camera, in a process of its own: JSON on standard input, a zip of two EXR files on its output.

`python -m worker.programs.stmap top-left|bottom-left`. Red and green say where to sample, 0..1; green counts from the
bottom for Nuke and Flame and from the top for Unreal.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from service import child_process
from service.formats.archive import archive
from service.schemas.venue import Camera
from worker.calibration.rendering.st_maps import StMap, distorting, undistorting
from worker.jobs.from_schemas import lens_of
from worker.programs.exr import end_without_openexr, exr


def main(origin: str) -> None:
    """Read the camera, write the maps."""
    child_process.begin_decoder()
    end_without_openexr()
    camera = Camera.model_validate_json(sys.stdin.buffer.read())
    lens = lens_of(camera.intrinsics, camera.image_size)
    maps = {"undistort": undistorting(lens), "distort": distorting(lens)}
    sys.stdout.buffer.write(archive({f"{name}.exr": exr("RGB", _from(origin, st)) for name, st in maps.items()}))


def _from(origin: str, st: StMap) -> NDArray[np.float32]:
    """Red, green and an empty blue (height, width, 3)."""
    s, t = st[..., 0], st[..., 1]
    return np.stack([s, 1 - t if origin == "bottom-left" else t, np.zeros_like(s)], axis=-1)


if __name__ == "__main__":
    main(*sys.argv[1:])
