"""A stitched view's package or its picture, in a process of its own: `python -m worker.programs.stitch`.

What comes is a `StitchRequest` and, for a picture, frames; what leaves is a zip or a
JPEG.
"""

import os
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2

from service import child_process
from service.schemas.programs.stitching import StitchRequest
from worker.calibration.rendering.layers import seam_layer
from worker.calibration.stitching.panorama import Contribution, Panorama, panorama
from worker.calibration.stitching.views import chosen_view
from worker.jobs.decoding import decode_frame
from worker.jobs.from_schemas import Picture, camera_of, choice_of, encode_jpeg, light_of, pitch_of
from worker.jobs.jpeg import decode_by_opencv
from worker.programs.stitch.package import package
from worker.programs.stitch.scaled import in_scaled, scaled_size

# Pixels of a view times cameras: 45 bytes are needed for each. Two cameras in 8192x2400 pixels, four in 3840x2160.
MOST_PLACES = 40_000_000


def main() -> None:
    """Read what is wanted, write it."""
    child_process.begin_decoder()
    request, files = StitchRequest.decode(sys.stdin.buffer.read())
    cv2.setNumThreads(request.threads)
    made = stitched(request)
    answer = encode_jpeg(picture(request, made, files)) if request.wanted == "picture" else package(request, made)
    sys.stdout.buffer.write(answer)


def stitched(request: StitchRequest) -> Panorama:
    """Return the panorama of the chosen view."""
    pitch, cameras = pitch_of(request.field), [camera_of(camera) for camera in request.cameras]
    view = chosen_view(pitch, cameras, choice_of(request.view))
    width, height = view.size
    if width * height * len(cameras) > MOST_PLACES:
        print(f"{len(cameras)} cameras in {width}x{height} pixels are too much: ask for fewer pixels", file=sys.stderr)
        sys.exit(os.EX_DATAERR)
    return panorama(pitch, view, cameras, {camera: light_of(light) for camera, light in request.lights.items()})


def picture(request: StitchRequest, made: Panorama, files: Mapping[str, bytes]) -> Picture:
    """Draw the view of frames, which are read no larger than it shows them, since somebody waits for it."""
    with ThreadPoolExecutor(request.threads) as each:
        read = [*each.map(lambda part: _read(part, files[part.camera]), made.parts)]
    smaller = replace(made, parts=[part for part, _ in read])
    drawn = smaller.picture({part.camera: frame for part, frame in read})
    if request.seam:
        layer = seam_layer(made.owner)
        painted = layer[..., 3] > 0
        drawn[painted] = layer[painted, :3]
    return drawn


def _read(part: Contribution, file: bytes) -> tuple[Contribution, Picture]:
    """A camera's frame, and what it gives to the view as it was read: of half the size where that is enough."""
    width, height = part.frame_size
    if width % 2 == height % 2 == 0 and scaled_size(part)[0] <= width // 2:
        half, size = decode_by_opencv(file, cv2.IMREAD_REDUCED_COLOR_2), (width // 2, height // 2)
        if half is not None and half.shape[1::-1] == size:
            return replace(part, frame_size=size, source=in_scaled(part, size)), half
    return part, decode_frame(part.camera, [width, height], file)


if __name__ == "__main__":
    main()
