"""The pictures of a calibration: what a person looks at before he trusts it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial

import cv2
import numpy as np
import structlog
from numpy.typing import NDArray

from worker.calibration.draw import layers, mosaic
from worker.calibration.draw.overlays import overlay
from worker.calibration.draw.viewpoint import viewpoint
from worker.calibration.judge.markings import MarkingSeen
from worker.calibration.records import Calibration
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.jobs.from_frames import Given
from worker.jobs.wire import Picture, jpeg, png

# Of the frames that layers are laid over: a wide screen. The overlays have the size of the frames.
FRAME_WIDTH, PREVIEW_WIDTH = 1920, 1920
FRAME_QUALITY = 75
# A camera, and the pitch as its pose has it.
Standing = tuple[Field, Camera]
log = structlog.get_logger()


def draw(given: Given, found: Calibration) -> dict[str, bytes]:
    """Files by name."""
    pitch, before, frames = given.pitch, given.cameras, given.frames
    after = [result.camera for result in found.cameras]
    first = {camera: several[0] for camera, several in frames.items()}
    view = cache(lambda: viewpoint(found.pitch, after, PREVIEW_WIDTH))
    parts: list[Callable[[], dict[str, bytes]]] = [
        lambda: _preview(mosaic.stitched(found.pitch, view(), after, first)),
        # The same view by the stored poses.
        lambda: {"preview_before": jpeg(mosaic.stitched(pitch, view(), before, first).picture)},
        lambda: {"birdseye": jpeg(mosaic.birdseye(found.pitch, after, first))},
    ]
    for old, result in zip(before, found.cameras, strict=True):
        new = result.camera
        frame, response = first[old.id], given.network.responses.get(old.id)
        parts += [
            partial(_overlay, (pitch, old), (found.pitch, new), frame, result.markings),
            partial(_layers, (pitch, old), (found.pitch, new), frame, response),
        ]
    pictures: dict[str, bytes] = {}
    for part in parts:
        try:
            pictures |= part()
        except Exception:  # poses that were rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw", exc_info=True)
    return pictures


def _preview(stitched: mosaic.Stitched) -> dict[str, bytes]:
    """One view by the new poses, and where one camera hands over to another in it."""
    return {"preview": jpeg(stitched.picture), "seam": png(layers.seam_layer(stitched.owner))}


def _overlay(stored: Standing, new: Standing, frame: Picture, seen: Sequence[MarkingSeen]) -> dict[str, bytes]:
    """The frame with both fields on it, and what is wrong with markings."""
    return {f"overlay_{stored[1].id}": jpeg(overlay(stored, new, frame, seen=seen))}


def _layers(stored: Standing, new: Standing, frame: Picture, response: NDArray[np.uint8] | None) -> dict[str, bytes]:
    """The frame, smaller, and what can be laid over it."""
    camera = stored[1].id
    width, height = stored[1].intrinsics.size
    size = (min(width, FRAME_WIDTH), round(height * min(1.0, FRAME_WIDTH / width)))
    small = np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
    drawn = {
        f"frame_{camera}": jpeg(small, FRAME_QUALITY),
        f"stored_{camera}": png(layers.stored_layer(*stored, size)),
        f"new_{camera}": png(layers.new_layer(*new, size)),
    }
    return drawn if response is None else drawn | {f"mask_{camera}": png(layers.mask_layer(response, size))}
