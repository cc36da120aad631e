"""Members of a result that earlier nights contribute: refined pose and lens, and change of the focal length.

The pose of a result belongs to the lens that the venue has. The refined one belongs to the lens as the lines have it,
those of tonight and those of the camera's memory together.
"""

import math
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np

from service.schemas.lens_limits import LARGEST_COEFFICIENT, LARGEST_SIGMA, LEAST_SIGMA
from service.schemas.lens_map import map_of
from service.schemas.results import LensChange, Refined
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.far_marking import far_marking_shift_m
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import SIGMA_NAMES, Lens
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.refinement import uncertainty
from worker.jobs.to_schemas import lens_to_schema, pose_to_schema, sigma_to_schema


def read_memories(documents: Mapping[str, Mapping[str, Any]]) -> dict[str, CameraMemory]:
    """Return the engine's memories of cameras, without those that another release wrote in another format."""
    read = {camera: CameraMemory.from_json(memory) for camera, memory in documents.items()}
    return {camera: memory for camera, memory in read.items() if memory is not None}


def refined_to_schema(pitch: Field, found: CameraResult) -> Refined | None:
    """Return the refined pose and lens of a camera, or None if it has none."""
    refined = found.refined
    if refined is None or not _is_a_camera(refined.camera):
        return None
    focal, focal_refined = (one.intrinsics.focal_length_px for one in (found.camera, refined.camera))
    covariance = refined.covariance if np.isfinite(refined.covariance).all() else None
    sigma = _lens_sigma(refined.camera.intrinsics, covariance)
    return Refined(
        pose=pose_to_schema(refined.camera.pose),
        intrinsics=lens_to_schema(refined.camera.intrinsics).model_copy(update={"sigma": sigma}),
        covariance=None if covariance is None else covariance.tolist(),
        sigma=sigma_to_schema(refined.sigma),
        longer=focal_refined / focal - 1,
        differs_m=far_marking_shift_m(pitch, found.camera, refined.camera),
    )


def _is_a_camera(camera: Camera) -> bool:
    """Return False for numbers that no lens has: lines that determine next to nothing can end there."""
    lens = camera.intrinsics
    numbers = np.concatenate([camera.pose.rotation, camera.pose.position, lens.matrix.ravel(), lens.distortion])
    focal = np.diag(lens.matrix)[:2]
    if not np.isfinite(numbers).all() or not (focal > 0).all():
        return False
    seen = map_of(lens.model, lens.matrix.tolist(), lens.distortion.tolist(), lens.size)
    return bool(np.abs(lens.distortion).max(initial=0.0) <= LARGEST_COEFFICIENT) and seen.is_usual


def _lens_sigma(lens: Lens, covariance: Array | None) -> dict[str, float] | None:
    """The standard deviations of the numbers of a lens, from the (12, 12) of pose and lens."""
    if covariance is None:
        return None
    sigma = np.sqrt(np.diag(covariance)[POSE_NUMBERS:]).clip(LEAST_SIGMA, LARGEST_SIGMA)
    named = zip(SIGMA_NAMES.items(), sigma.tolist(), strict=True)
    return {short: value for (name, short), value in named if name in lens.parameters}


def lens_change_to_schema(found: CameraResult, tonight: datetime | None) -> LensChange | None:
    """Return the change of the focal length since the first nights of a memory, or None without a memory."""
    change = found.lens_change
    if change is None or not math.isfinite(change.sigma) or not math.isfinite(change.longer):
        return None
    return LensChange(
        longer=change.longer,
        sigma=change.sigma,
        since=None if change.since is None else change.since.isoformat(),
        words=lens_change_in_words(change, tonight),
    )


def lens_change_in_words(change: uncertainty.LensChange, tonight: datetime | None) -> str | None:
    """The change for a person, for instance "focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus".

    None while it may be chance, or heat.
    """
    if not change.notable:
        return None
    places = max(0, -math.floor(math.log10(100 * change.sigma))) if change.sigma > 0 else 2
    by = f"{100 * abs(change.longer):.{places}f} ± {100 * change.sigma:.{places}f} %"
    than = f"on {_day(change.since, tonight)}" if change.since else "in its first nights"
    return f"focal length {by} {'longer' if change.longer > 0 else 'shorter'} than {than}: zoom ring or focus"


def _day(moment: datetime, tonight: datetime | None) -> str:
    """Return a day in words, with its year only if that is not tonight's."""
    day = f"{moment.day} {moment:%B}"
    return day if tonight is not None and tonight.year == moment.year else f"{day} {moment.year}"
