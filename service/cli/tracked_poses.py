"""Poses that `esc stitch --follow` writes beside the clip, and a summary of the movement of cameras.

Imports the engine, see `local_engine`.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from service.cli.printing import FAILED, fail, print_note
from service.formats.clip import ClipPoses, TrackedCamera
from service.formats.lens import NumberedCamera
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue
from worker.calibration.geometry import camera as engine
from worker.calibration.tracking.follower import TrackedMoment, TrackedPose
from worker.jobs.to_schemas import lens_to_schema, pose_to_schema
from worker.video.tracking import MotionSummary, TrackedGeometryFactory


@contextmanager
def tracking(venue: Venue, every: int, stem: Path | None, freed_axes: str) -> Iterator[TrackedGeometryFactory]:
    """Yield what tracks the cameras of a clip that the block makes, and write their poses to files `stem`.*, if any."""
    if stem is None:
        follow = TrackedGeometryFactory(every)
        yield follow
        follow.finish()
        return
    stored = {
        camera.id: NumberedCamera(camera, number, camera.encoders) for number, camera in enumerate(venue.cameras, 1)
    }
    try:
        with ClipPoses(stem, [*stored.values()], freed_axes) as poses:

            def keep(moment: TrackedMoment, rate: Fraction) -> None:
                poses.add([_tracked_camera(one, stored[one.camera.id]) for one in moment.cameras], rate)

            follow = TrackedGeometryFactory(every, keep)
            yield follow
            follow.finish()
    except Problem as problem:
        fail(problem.detail, FAILED)


def print_motions(motions: Mapping[str, MotionSummary]) -> None:
    """Print the largest turn of each camera and how its pictures were measured."""
    for camera, motion in motions.items():
        unseen = motion.how["coasted"], motion.how["refused"]
        print_note(
            f"Camera {camera} turned by up to {motion.farthest_deg:.2f} degrees from its first picture; lines measured "
            f"in {motion.how['measured']} of {motion.how.total()} pictures, not seen or not looked for in {unseen[0]}, "
            f"not believed in {unseen[1]}"
        )


def motion_document(motion: MotionSummary) -> dict[str, Any]:
    """Return a summary of the movement of a camera for JSON."""
    return {
        "farthest_deg": round(motion.farthest_deg, 4),
        **{how: motion.how[how] for how in ("measured", "coasted", "refused")},
    }


def _tracked_camera(followed: TrackedPose, stored: NumberedCamera) -> TrackedCamera:
    sigma, motion = followed.sigma, followed.motion_sigma
    return TrackedCamera(
        replace(stored, camera=camera_document(followed.camera)),
        followed.how,
        (sigma.rotation_deg, sigma.position_m),
        (motion.rotation_deg, motion.position_m),
    )


def camera_document(camera: engine.Camera) -> Camera:
    """Return a camera of the engine as a schema, with the lens of its frames, which may be smaller than stored."""
    return Camera(
        id=camera.id,
        image_size=list(camera.intrinsics.size),
        intrinsics=lens_to_schema(camera.intrinsics),
        pose=pose_to_schema(camera.pose),
    )
