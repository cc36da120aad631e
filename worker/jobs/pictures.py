"""The pictures of a calibration, by which a person judges it."""

import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from service.store.jobs.files import BIRDSEYE, OF_CAMERA, STITCHED, names_of_all
from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.rendering import layers
from worker.calibration.rendering.overlays import overlay
from worker.calibration.rendering.stitched_pictures import birdseye, stitched
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.jobs.from_schemas import Picture, encode_jpeg, encode_png
from worker.jobs.masks import size_as_shown

PREVIEW_WIDTH = 1920
FRAME_QUALITY = 75
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PictureInputs:
    """Inputs of the pictures: pitch and cameras as `stored` and as `found`, and a frame of each camera.

    `markings`: reports on them, by the camera that sees them. `lights`: photometric corrections by camera.
    """

    stored: tuple[Field, Sequence[Camera]]
    found: tuple[Field, Sequence[Camera]]
    frames: Mapping[str, Picture]
    markings: Mapping[str, Sequence[MarkingReport]]
    lights: Mapping[str, Light]

    @property
    def names(self) -> list[str]:
        """Names of all pictures that can be drawn."""
        return names_of_all([camera.id for camera in self.stored[1]])


def draw(scene: PictureInputs, names: Sequence[str]) -> dict[str, bytes]:
    """Draw the pictures of these names; return the files by name."""
    parts: list[Callable[[], dict[str, bytes]]] = []
    if {*names} & {*STITCHED}:
        parts.append(partial(_stitched, scene, names))
    if {*names} & {*BIRDSEYE}:
        parts.append(lambda: {"birdseye": encode_jpeg(birdseye(*scene.found, scene.frames, evened=scene.lights))})
    for number, camera in enumerate(scene.stored[1]):
        if {*names} & {f"{kind}_{camera.id}" for kind in OF_CAMERA}:
            parts.append(partial(_of_camera, scene, number, names))
    pictures: dict[str, bytes] = {}
    for part in parts:
        try:
            pictures |= part()
        except Exception:  # poses that were rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw", exc_info=True)
    return pictures


def _stitched(scene: PictureInputs, names: Sequence[str]) -> dict[str, bytes]:
    """Draw what is wanted of the stitched view by the new poses, its seams, and the view by the stored poses."""
    view = chosen_view(*scene.found, ViewChoice(width=PREVIEW_WIDTH))
    standings = {"preview": scene.found, "preview_before": scene.stored}
    needed = {*names} | ({"preview"} if "seam" in names else set())
    wanted = {name: standing for name, standing in standings.items() if name in needed}
    # Somebody may wait, and each of them keeps a core busy.
    with ThreadPoolExecutor(len(wanted)) as both:
        drawn_in_order = both.map(
            lambda standing: stitched(standing[0], view, standing[1], scene.frames, scene.lights), wanted.values()
        )
        drawn = dict(zip(wanted, drawn_in_order, strict=True))
    pictures = {name: encode_jpeg(one.picture) for name, one in drawn.items() if name in names}
    if "seam" in names:
        pictures["seam"] = encode_png(layers.seam_layer(drawn["preview"].owner))
    return pictures


def _of_camera(scene: PictureInputs, number: int, names: Sequence[str]) -> dict[str, bytes]:
    """Draw what is wanted of a camera: its frame with both fields and faults of markings, a smaller one, its layers."""
    stored, new = ((pitch, cameras[number]) for pitch, cameras in (scene.stored, scene.found))
    camera, size = stored[1].id, size_as_shown(stored[1])
    frame = scene.frames[camera]

    def small() -> Picture:
        return np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)

    ways: dict[str, Callable[[], bytes]] = {
        f"overlay_{camera}": lambda: encode_jpeg(overlay(stored, new, frame, seen=scene.markings[camera])),
        f"frame_{camera}": lambda: encode_jpeg(small(), FRAME_QUALITY),
        f"stored_{camera}": lambda: encode_png(layers.stored_layer(*stored, size)),
        f"new_{camera}": lambda: encode_png(layers.new_layer(*new, size)),
    }
    return {name: draw_it() for name, draw_it in ways.items() if name in names}
