"""Pictures of a calibration when somebody looks at them, in a process of its own.

`python -m worker.programs.draw`. What comes is a `service.wire.programs.drawing.Drawing` and frames, what leaves a
`Drawn` and the pictures.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import cast

import cv2

from service import lifeline
from service.wire.programs.drawing import Drawing, Drawn, SeenMarking, Standing, packed, unpacked
from worker.calibration.judge.markings import OPPOSITE, Direction, MarkingSeen
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.jobs.pictures import Scene, draw
from worker.jobs.reading import decoded_frame, light_of, pitch_of, watching


def main() -> None:
    """Read the frames, write the pictures."""
    lifeline.end_with_parent()
    logging.basicConfig()
    given = sys.stdin.buffer.read()
    asked = Drawing.model_validate_json(given[: given.index(b"\n")])
    cv2.setNumThreads(asked.threads)
    pictures = draw(scene_of(asked, unpacked(asked.sizes, given)), asked.names)
    drawn = Drawn(sizes={name: len(picture) for name, picture in pictures.items()})
    sys.stdout.buffer.write(packed(drawn, pictures))


def scene_of(asked: Drawing, files: Mapping[str, bytes]) -> Scene:
    """Frames only of the cameras whose files came."""
    sizes = {camera.id: camera.image_size for camera in asked.stored.cameras}
    with ThreadPoolExecutor(asked.threads) as each:
        frames = each.map(lambda camera: decoded_frame(camera, sizes[camera], files[camera]), files)
        decoded = dict(zip(files, frames, strict=True))
    markings = {camera: [_seen(one) for one in seen] for camera, seen in asked.markings.items()}
    lights = {camera: light_of(light) for camera, light in asked.lights.items()}
    return Scene(_standing(asked.stored, asked), _standing(asked.found, asked), decoded, markings, lights)


def _standing(standing: Standing, asked: Drawing) -> tuple[Field, list[Camera]]:
    return pitch_of(standing.field), [watching(camera, asked.ignore[camera.id]) for camera in standing.cameras]


def _seen(told: SeenMarking) -> MarkingSeen:
    """The engine's: its offset is positive on one of the two sides, and that is the direction."""
    direction = cast(Direction | None, told.side)
    if told.offset_m is not None and told.offset_m < 0:
        direction = next(one for one, opposite in OPPOSITE.items() if opposite == told.side)
    return MarkingSeen(told.name, told.expected_m, told.found, told.offset_m, told.sigma_m, direction)


if __name__ == "__main__":
    main()
