"""A job of the kind `check`: from a calibration of any origin and frames of its cameras to a grade for each."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from service.schemas.check import GRADES, CameraCheck, CheckCause, CheckedCamera, CheckedFile, CheckResult
from service.schemas.frame_sizes import is_resized, other_shape
from service.schemas.job import Progress
from service.schemas.lens_map import LEAST_BLIND_SHARE, map_of, times_larger
from worker.calibration.checking.check import GivenCamera, check_cameras
from worker.calibration.checking.grade import GradedCamera, grade
from worker.calibration.geometry import camera as engine
from worker.calibration.geometry.lens import Lens
from worker.compute_resources import ComputeResources
from worker.jobs.decoding import decode_frames, size_of
from worker.jobs.from_schemas import JobFailedError, lens_of, pitch_of, pose_of
from worker.jobs.to_schemas import (
    Solution,
    engine_run,
    field_to_schema,
    finite_or_none,
    lens_to_schema,
    load_segmenter,
    pose_to_schema,
    round_to_ms,
)


def solve(
    given: CheckedFile,
    files: Mapping[str, Sequence[bytes]],
    means: ComputeResources,
    report: Callable[[Progress], None],
) -> Solution[CheckResult]:
    """Grade each camera by the files of its frames. Raises `JobFailedError` for frames of no use."""
    begun = time.perf_counter()
    segmenter = load_segmenter(means)
    cv2.setNumThreads(means.threads)
    warnings: list[str] = []
    frames = {camera.id: decode_frames(camera.id, None, files[camera.id], warnings.append) for camera in given.cameras}
    cameras = [_given(camera, size_of(frames[camera.id][0])) for camera in given.cameras]
    pitch = pitch_of(given.field)
    with engine_run(report) as step:
        checked = check_cameras(pitch, cameras, frames, segmenter, given.seed or 0, step)
    graded = [_to_schema(grade(one, _folds(one.meant.intrinsics))) for one in checked]
    fitted = next((one.pitch for one in checked if one.pitch is not pitch), None)
    if fitted is not None:
        warnings.append(
            f"The calibration fits the lines on a field of {fitted.length:.2f} x {fitted.width:.2f} m with a ridge "
            f"{fitted.ridge_height:.2f} m high, and not on the given one. Measure the field, or give it with --site"
        )
    result = CheckResult(
        grade=next(worst for worst in GRADES if any(one.grade == worst for one in graded)),
        format=given.format,
        field=given.field if fitted is None else field_to_schema(given.field, fitted),
        cameras=graded,
        warnings=warnings,
        timings_s=round_to_ms({"check": time.perf_counter() - begun}),
        software=means.software,
    )
    return Solution(result, {})


def _given(camera: CheckedCamera, size: tuple[int, int]) -> GivenCamera:
    """Return a camera with its lens for frames of a size."""
    written_for = size if camera.image_size is None else (camera.image_size[0], camera.image_size[1])
    if not is_resized(size, written_for):
        raise JobFailedError("frame-size", other_shape(camera.id, size, written_for), camera.id)
    lens = lens_of(camera.intrinsics, [*written_for])
    if written_for != size:
        lens = replace(lens.scaled(size[0] / written_for[0]), size=size)
    larger = times_larger(camera.intrinsics.matrix, written_for)
    resized = None if larger is None else replace(lens.scaled(larger), size=size)
    pose = NO_POSE if camera.pose is None else pose_of(camera.pose)
    return GivenCamera(
        engine.Camera(camera.id, lens, pose), written_for != size, resized, _reordered(lens), camera.pose is not None
    )


def _reordered(lens: Lens) -> Lens | None:
    """Return a lens whose five coefficients are read as k1, k2, k3, p1, p2; None where that changes nothing."""
    if lens.model != "opencv" or len(lens.distortion) != 5 or np.ptp(lens.distortion[2:]) == 0:
        return None
    return replace(lens, distortion=lens.distortion[[0, 1, 3, 4, 2]])


NO_POSE = engine.Pose(np.zeros(3), np.zeros(3))


def _folds(lens: Lens) -> str | None:
    """Return words about a lens without rays for a part of its picture; None for a good one."""
    seen = map_of(lens.model, lens.matrix.tolist(), lens.distortion.tolist(), lens.size)
    if seen.blind_share < LEAST_BLIND_SHARE:
        return None
    return (
        f"its distortion folds {seen.radius_px:.0f} px from the middle: {max(seen.blind_share, 0.01):.0%} of the "
        "picture has no ray"
    )


def _to_schema(graded: GradedCamera) -> CameraCheck:
    checked, difference = graded.checked, graded.difference
    found = checked.found
    return CameraCheck(
        id=checked.given.id,
        grade=graded.grade,
        causes=[CheckCause(cause=cause, detail=detail) for cause, detail in graded.causes],
        off_px=None if difference is None else finite_or_none(difference.pixels),
        sigma_px=None if difference is None else difference.sigma_pixels,
        off_m=None if difference is None else difference.metres,
        sigma_m=None if difference is None else difference.sigma_metres,
        detail=checked.refusal,
        image_size=[*checked.given.intrinsics.size],
        pose=None if found is None else pose_to_schema(found.camera.pose),
        intrinsics=None if found is None else lens_to_schema(found.camera.intrinsics),
    )
