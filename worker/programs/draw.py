"""Pictures of a calibration when somebody looks at them, in a process of its own.

`python -m worker.programs.draw`. What comes is a `service.wire.drawing.Drawing` and frames, what leaves a `Drawn` and
the pictures.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Mapping

import cv2

from service import lifeline
from service.wire.drawing import Drawing, Drawn, packed, unpacked
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.jobs.pictures import Scene, draw
from worker.jobs.reading import camera_of, decoded_frame, pitch_of

# The presets whose method is: `settle.METHODS` says so too, and loads the whole engine with it.
FLAT = ("scpr",)


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
    """What the job had before it when it was done; frames only of the cameras whose files came."""
    cameras = {camera.id: camera for camera in asked.venue.cameras}
    pitch = pitch_of(asked.venue.field)
    return Scene(
        (pitch, [camera_of(camera) for camera in asked.venue.cameras]),
        (_found_pitch(asked, pitch), _found_cameras(asked)),
        {camera: decoded_frame(camera, cameras[camera].image_size, file) for camera, file in files.items()},
    )


def _found_cameras(asked: Drawing) -> list[Camera]:
    """With the lens that was found, where one was."""
    found = zip(asked.venue.cameras, asked.result.cameras, strict=True)
    return [
        camera_of(camera.model_copy(update={"pose": new.pose, "intrinsics": new.intrinsics or camera.intrinsics}))
        for camera, new in found
    ]


def _found_pitch(asked: Drawing, pitch: Field) -> Field:
    """As it was finished on: flat, or with the ridge that was found."""
    options, ridge = asked.result.provenance.options, asked.result.ridge
    if options["flat"] or options["preset"] in FLAT:
        return pitch.flat()
    return pitch if ridge is None else pitch_of(asked.venue.field.model_copy(update={"ridge": ridge}))


if __name__ == "__main__":
    main()
