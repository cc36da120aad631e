"""A job of the kind `find`: from frames of cameras without poses to these cameras, and a picture of each candidate."""

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import cast

import cv2
import numpy as np

from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.geometry import Intrinsics, PosedCamera
from service.schemas.geometry import Pose as PoseSchema
from service.schemas.job import Progress
from service.schemas.lens_map import lens_doubts
from service.schemas.names import Panorama as PanoramaModel
from service.schemas.results import CandidateResult, FindResult, FoundCameraResult, Provenance
from service.store.jobs.files import candidate_picture_name
from worker.calibration.find_cameras import FoundCamera, FoundCameras, find_cameras
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens_models import PANORAMAS
from worker.calibration.geometry.panorama import Panorama
from worker.calibration.geometry.parameters import free_lens_sigma
from worker.calibration.planning.stand import field_of_view_deg
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.sought import (
    BENDS,
    OTHER_BENDS,
    Place,
    SoughtCamera,
    SoughtLens,
    lenses_of_view,
    panorama_of_view,
    unknown_lenses,
)
from worker.calibration.rendering.overlays import candidate_picture
from worker.compute_resources import ComputeResources
from worker.jobs.decoding import decode_frames, size_of
from worker.jobs.from_schemas import Picture, camera_of, encode_jpeg, ignored_areas_of, lens_of, pitch_of
from worker.jobs.to_schemas import (
    Solution,
    engine_run,
    finite_or_none,
    lens_to_schema,
    load_segmenter,
    pose_to_schema,
    provenance_of,
    ridge_to_schema,
    round_to_ms,
    sigma_to_schema,
)

USUAL_PANORAMA_DEG = 155.0
"""Field of view of a panorama of which nothing is said; with 30 % to either side, cameras of two to four lenses."""
WIDEST_SENSOR = 2.1
"""Ratio of width to height beyond which a picture was stitched or cropped: sensors are 2 to 1 at most."""
log = logging.getLogger(__name__)
FIELD_OF_VIEW_UNCERTAIN = 0.15
"""One standard deviation of the focal length that a given field of view leaves, as a part of it."""
PANORAMA_UNCERTAIN = 0.05
"""Relative sigma of a panorama's focal length: data sheets give its angle to ten degrees, and stitching crops it."""


def solve(
    site: SoughtSite,
    files: Mapping[str, Sequence[bytes]],
    seed: int,
    means: ComputeResources,
    report: Callable[[Progress], None],
) -> Solution[FindResult]:
    """Find the cameras of a site that have no pose, from the files of their frames, and draw each candidate."""
    segmenter = load_segmenter(means)
    cv2.setNumThreads(means.threads)
    remarks: dict[str, list[str]] = {camera.id: [] for camera in site.cameras}
    frames = {
        camera.id: decode_frames(camera.id, camera.image_size, files[camera.id], remarks[camera.id].append)
        for camera in site.cameras
        if camera.id in files
    }
    pitch = pitch_of(site.field)
    sought = [sought_camera(one, size_of(frames[one.id][0])) for one in site.cameras if one.pose is None]
    known = [_known(camera) for camera in site.cameras if camera.pose is not None]
    with engine_run(report) as step:
        found = find_cameras(pitch, sought, known, frames, segmenter, seed, step)
    pictures = {
        name: picture
        for camera in found.cameras
        for name, picture in _pictures(pitch, found.pitch, camera, frames[camera.id][0]).items()
    }
    provenance = provenance_of(means, segmenter, seed, {"seed": seed})
    return Solution(_result(found, pitch, site, sought, provenance, remarks), pictures)


def sought_camera(camera: SoughtCameraIn, size: tuple[int, int]) -> SoughtCamera:
    """Make the engine's camera out of what a site says of one whose frames have a `size` (width, height)."""
    position = None if camera.position is None else np.array(camera.position)
    place = Place(camera.side, position, camera.position_radius_m)
    ignored = ignored_areas_of(camera.ignore, size)
    if camera.panorama is not None:
        return SoughtCamera(camera.id, _panoramas(camera.panorama, size, camera.field_of_view_deg), place, ignored)
    if camera.intrinsics is not None:
        lens = lens_of(camera.intrinsics, list(size))
        usual = free_lens_sigma(lens) if isinstance(lens, Panorama) else {}
        sigma_px = lens.sigma.get("fx", usual.get("fx", 0.0))
        return SoughtCamera(camera.id, [SoughtLens.around(lens, sigma_px / lens.focal_length_px)], place, ignored)
    if camera.field_of_view_deg is not None:
        of_view = partial(lenses_of_view, size, camera.field_of_view_deg, FIELD_OF_VIEW_UNCERTAIN)
        return SoughtCamera(camera.id, of_view(BENDS), place, ignored, of_view(OTHER_BENDS))
    others = _panoramas("cylindrical", size, None) if _is_stitched(size) else unknown_lenses(size, OTHER_BENDS)
    return SoughtCamera(camera.id, unknown_lenses(size, BENDS), place, ignored, others)


def _is_stitched(size: tuple[int, int]) -> bool:
    """True for pictures (width, height) of a shape that no sensor has."""
    return size[0] > WIDEST_SENSOR * size[1]


def _panoramas(model: PanoramaModel, size: tuple[int, int], view_deg: float | None) -> list[SoughtLens]:
    """Return panoramas of about this field of view, or of a usual one."""
    uncertain = FIELD_OF_VIEW_UNCERTAIN if view_deg is None else PANORAMA_UNCERTAIN
    lens = panorama_of_view(size, PANORAMAS[model], view_deg or USUAL_PANORAMA_DEG)
    return [SoughtLens.around(lens, uncertain)]


def _known(camera: SoughtCameraIn) -> Camera:
    """A camera that need not be found; the schema has seen to it that it is complete."""
    assert camera.pose is not None
    pose = PoseSchema.from_input(camera.pose)
    intrinsics = cast(Intrinsics, camera.intrinsics)
    return camera_of(PosedCamera(id=camera.id, image_size=camera.image_size or [], intrinsics=intrinsics, pose=pose))


def _pictures(given: Field, found: Field, camera: FoundCamera, frame: Picture) -> dict[str, bytes]:
    """A picture of each candidate, the best first, on the field that it was refined on."""
    pictures = {}
    for number, one in enumerate(camera.candidates, start=1):
        name = candidate_picture_name(camera.id, number)
        try:
            first = 1 if camera.assumed_side is None else 2
            pitch = found if camera.was_calibrated and number <= first else given
            pictures[name] = encode_jpeg(candidate_picture(pitch, one.camera, frame, f"candidate {number}"))
        except Exception:  # what is no camera of this frame may look anywhere; a picture is not worth losing the others
            log.warning("cannot draw %s", name, exc_info=True)
    return pictures


def _result(
    found: FoundCameras,
    given: Field,
    site: SoughtSite,
    sought: Sequence[SoughtCamera],
    provenance: Provenance,
    frame_remarks: Mapping[str, Iterable[str]],
) -> FindResult:
    doubts = {
        camera.id: lens_doubts(camera.intrinsics, camera.image_size)
        for camera in site.cameras
        if camera.intrinsics is not None and camera.image_size is not None
    }
    remarks = {one.id: [*doubts.get(one.id, []), *dict.fromkeys(frame_remarks[one.id])] for one in sought}
    undeclared = {camera.id for camera in site.cameras if camera.intrinsics is None and camera.panorama is None}
    for one, camera in zip(found.cameras, sought, strict=True):
        if one.id in undeclared:
            remarks[one.id] += _stitched_remark(one, camera.size)
    refusals = [f"camera {one.id}: {one.refusal.words}" for one in found.cameras if one.refusal is not None]
    return FindResult(
        accepted=not refusals,
        rejected_because="; ".join(refusals) or None,
        cameras=[_camera(one, camera.size, remarks[one.id]) for one, camera in zip(found.cameras, sought, strict=True)],
        ridge=ridge_to_schema(found.pitch) if given.ridge is None else None,
        stitch_error_px=finite_or_none(found.stitch_error_px),
        timings_s=round_to_ms(found.timings.seconds),
        cpu_s=round_to_ms(found.timings.core_seconds),
        provenance=provenance,
    )


def _stitched_remark(found: FoundCamera, size: tuple[int, int]) -> list[str]:
    """Return in words that the frame of a camera without a lens is a stitched panorama, or may be one."""
    camera = found.candidates[0].camera if found.accepted else None
    if camera is not None and isinstance(camera.intrinsics, Panorama):
        return [
            f"this is a stitched panorama of {field_of_view_deg(camera):.0f}°: its lines fit no lens of a single "
            f"camera, and fit one that is {camera.intrinsics.model}"
        ]
    if camera is None and _is_stitched(size):
        return [
            f"this picture is {size[0] / size[1]:.1f} times as wide as high, as no sensor is: if it is a stitched "
            f"panorama, say which (panorama: {', '.join(PANORAMAS)}) and its field_of_view_deg"
        ]
    return []


def _camera(found: FoundCamera, size: tuple[int, int], remarks: Sequence[str]) -> FoundCameraResult:
    return FoundCameraResult(
        id=found.id,
        accepted=found.accepted,
        reason=None if found.refusal is None else found.refusal.reason,
        rejected_because=None if found.refusal is None else found.refusal.words,
        remarks=[*remarks, *found.remarks],
        assumed_side=found.assumed_side,
        image_size=list(size),
        candidates=[_candidate(one) for one in found.candidates],
    )


def _candidate(candidate: Candidate) -> CandidateResult:
    return CandidateResult(
        intrinsics=lens_to_schema(candidate.camera.intrinsics),
        pose=pose_to_schema(candidate.camera.pose),
        agreement=candidate.agreement,
        lines_found=candidate.evidence.share,
        residual_px=finite_or_none(candidate.residual_px),
        sigma=sigma_to_schema(candidate.sigma),
    )
