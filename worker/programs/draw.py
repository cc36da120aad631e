"""Pictures of a calibration when somebody looks at them, in a process of its own.

`python -m worker.programs.draw`. What comes is a `DrawingRequest` and frames, what leaves the pictures, without those
that cannot be drawn.
"""

import logging
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import cast

import cv2

from service import child_process
from service.schemas.programs.drawing import DrawingRequest, FieldAndCameras, MarkingToDraw
from service.schemas.programs.files import ProgramMessage
from worker.calibration.diagnostics.markings import OPPOSITE, Direction, MarkingReport
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.jobs.decoding import decode_frame
from worker.jobs.from_schemas import camera_with_ignored_areas, light_of, pitch_of
from worker.jobs.pictures import PictureInputs, draw


def main() -> None:
    """Read the frames, write the pictures."""
    child_process.begin_decoder()
    logging.basicConfig()
    request, files = DrawingRequest.decode(sys.stdin.buffer.read())
    cv2.setNumThreads(request.threads)
    pictures = draw(scene_of(request, files), request.names)
    sys.stdout.buffer.write(ProgramMessage().encode(pictures))


def scene_of(request: DrawingRequest, files: Mapping[str, bytes]) -> PictureInputs:
    """Frames only of the cameras whose files came."""
    sizes = {camera.id: camera.image_size for camera in request.stored.cameras}
    with ThreadPoolExecutor(request.threads) as each:
        frames = each.map(lambda camera: decode_frame(camera, sizes[camera], files[camera]), files)
        decoded = dict(zip(files, frames, strict=True))
    markings = {camera: [_seen(one) for one in seen] for camera, seen in request.markings.items()}
    lights = {camera: light_of(light) for camera, light in request.lights.items()}
    return PictureInputs(
        _standing(request.stored, request), _standing(request.found, request), decoded, markings, lights
    )


def _standing(standing: FieldAndCameras, request: DrawingRequest) -> tuple[Field, list[Camera]]:
    return pitch_of(standing.field), [
        camera_with_ignored_areas(camera, request.ignore[camera.id]) for camera in standing.cameras
    ]


def _seen(told: MarkingToDraw) -> MarkingReport:
    """The engine's: its offset is positive on one of the two sides, and that is the direction."""
    direction = cast(Direction | None, told.side)
    if told.offset_m is not None and told.offset_m < 0:
        direction = next(one for one, opposite in OPPOSITE.items() if opposite == told.side)
    return MarkingReport(told.name, told.expected_m, told.found, told.offset_m, told.sigma_m, direction)


if __name__ == "__main__":
    main()
