"""Pictures stitched from all cameras for people: the preview, from between the cameras, and the bird's-eye view."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.stitching.panorama import Panorama, panorama
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import StitchedView, ViewFromAbove

NOT_KNOWN: Mapping[str, Light] = MappingProxyType({})


@dataclass(frozen=True)
class Stitched:
    """Picture stitched from all cameras, BGR (H, W, 3); `owner` (H, W): camera that counts most, or -1."""

    picture: Frame
    owner: NDArray[np.int8]


def stitched(
    pitch: Field,
    view: StitchedView,
    cameras: Sequence[Camera],
    frames: Mapping[str, Frame],
    evened: Mapping[str, Light] = NOT_KNOWN,
) -> Stitched:
    """Stitch the frames into one view: pictures of two sets of poses from the same place can be compared.

    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics. `evened`: corrections by camera;
    without any, as these frames say.
    """
    made = _made(pitch, view, cameras, frames, evened)
    return Stitched(made.picture(frames), made.owner)


def birdseye(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Frame],
    pixels_per_metre: float | None = None,
    margin_m: float = 3,
    evened: Mapping[str, Light] = NOT_KNOWN,
) -> Frame:
    """Draw the field from straight above, BGR: x to the right, y up, the field's centre in the centre pixel.

    `pixels_per_metre`: unless said 10, and more where the field would come out shorter than 800 pixels.
    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics.
    """
    pixels_per_metre = pixels_per_metre or max(10.0, 800 / pitch.length)
    columns = round((pitch.length / 2 + margin_m) * pixels_per_metre)
    rows = round((pitch.width / 2 + margin_m) * pixels_per_metre)
    view = ViewFromAbove(1 / pixels_per_metre, (2 * columns + 1, 2 * rows + 1))
    return _made(pitch, view, cameras, frames, evened).picture(frames)


def _made(
    pitch: Field,
    view: StitchedView,
    cameras: Sequence[Camera],
    frames: Mapping[str, Frame],
    evened: Mapping[str, Light],
) -> Panorama:
    """Return the panorama with seams in the middle between cameras, where wrong poses show."""
    lights = evened or evened_out(pitch, cameras, frames)
    return panorama(pitch, view, cameras, {camera: replace(light, reach=0.0) for camera, light in lights.items()})
