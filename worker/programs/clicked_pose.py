"""The first pose of a camera while its points are being clicked, in a process of its own: JSON in, JSON out.

`python -m worker.programs.clicked_pose`. What comes is a `ClickedPoseRequest`, what
leaves a `ClickedPose`.
"""

import sys
import time
from math import isfinite

from service import child_process
from service.schemas.programs.clicked_pose import ClickedPose, ClickedPoseRequest, Polyline
from worker.calibration.geometry.camera import Camera, inside
from worker.calibration.geometry.field import Field
from worker.calibration.rendering.overlays import centre_lines
from worker.jobs.from_schemas import JobFailedError, lens_of, pitch_of
from worker.jobs.locate import clicks_of, pose_of, result_of

# A line is drawn as far as this beside the picture, in widths of it: what is further out is not worth drawing.
BESIDE = 0.25
# Every so many-th point of a marking is drawn; they are a quarter of a metre apart.
EVERY = 3


def main() -> None:
    """Read the clicks, write the pose."""
    child_process.begin_decoder()
    request = ClickedPoseRequest.model_validate_json(sys.stdin.buffer.read())
    sys.stdout.write(answer(request).model_dump_json())


def answer(request: ClickedPoseRequest) -> ClickedPose:
    """Return the pose, the lines of the field and the expected clicks by it, or why there is none."""
    begun = time.perf_counter()
    pitch = pitch_of(request.field)
    try:
        clicks = clicks_of(request.id, pitch, request.points)
        found = pose_of(request.id, pitch, lens_of(request.intrinsics, request.image_size), clicks)
    except JobFailedError as failure:
        return ClickedPose(result=None, error=failure.error, lines=[], expected=[])
    result = result_of(found, request.points, {"fit": time.perf_counter() - begun})
    expected = [[float(x), float(y)] if isfinite(x + y) else None for x, y in found.camera.project(clicks.world)]
    return ClickedPose(result=result, error=None, lines=_lines(pitch, found.camera), expected=expected)


def _lines(pitch: Field, camera: Camera) -> list[Polyline]:
    """Return each marking in pixels, broken where the camera does not see it."""
    lines: list[Polyline] = []
    width, _ = camera.intrinsics.size
    for places in centre_lines(pitch, camera):
        seen = inside(places, camera.intrinsics.size, margin=-BESIDE * width)
        piece: Polyline = []
        for number, (place, visible) in enumerate(zip(places.round(1).tolist(), seen, strict=True)):
            if visible and (number % EVERY == 0 or number == len(places) - 1):
                piece.append(place)
            elif not visible:
                lines.append(piece)
                piece = []
        lines.append(piece)
    return [line for line in lines if len(line) > 1]


if __name__ == "__main__":
    main()
