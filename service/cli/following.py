"""What `esc stitch --follow` makes beside the clip: poses in files, and what is to be said of how cameras moved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.printing import FAILED, fail, tell
from service.formats.clip import ClipPoses, FollowedShot
from service.formats.lens import Shot
from service.wire.problems import Problem

if TYPE_CHECKING:
    from service.wire.venue import Camera, Venue
    from worker.calibration.follow.follower import Followed, Moment
    from worker.calibration.scene import camera as engine
    from worker.video.follow import Following, Motion


@contextmanager
def following(venue: Venue, every: int, stem: Path | None, freed_axes: str) -> Iterator[Following]:
    """What follows the cameras of a clip, which is made inside; their poses go into files beside `stem`, if any."""
    from worker.video.follow import Following

    if stem is None:
        follow = Following(every)
        yield follow
        follow.finish()
        return
    numbers = {camera.id: number for number, camera in enumerate(venue.cameras, 1)}
    try:
        with ClipPoses(stem, [Shot(camera, numbers[camera.id]) for camera in venue.cameras], freed_axes) as poses:

            def keep(moment: Moment, rate: Fraction) -> None:
                poses.add([_shot(one, numbers) for one in moment.cameras], rate)

            follow = Following(every, keep)
            yield follow
            follow.finish()
    except Problem as problem:
        fail(problem.detail, FAILED)


def tell_motions(motions: Mapping[str, Motion]) -> None:
    """Lines for whoever looks."""
    for camera, motion in motions.items():
        unseen = motion.how["coasted"], motion.how["refused"]
        tell(
            f"Camera {camera} turned by up to {motion.farthest_deg:.2f} degrees from its first picture; lines measured "
            f"in {motion.how['measured']} of {motion.how.total()} pictures, not seen or not looked for in {unseen[0]}, "
            f"not believed in {unseen[1]}"
        )


def document_of(motion: Motion) -> dict[str, Any]:
    """The same for programs."""
    return {
        "farthest_deg": round(motion.farthest_deg, 4),
        **{how: motion.how[how] for how in ("measured", "coasted", "refused")},
    }


def _shot(followed: Followed, numbers: Mapping[str, int]) -> FollowedShot:
    sigma, motion = followed.sigma, followed.motion_sigma
    return FollowedShot(
        Shot(_camera(followed.camera), numbers[followed.camera.id]),
        followed.how,
        (sigma.rotation_deg, sigma.position_m),
        (motion.rotation_deg, motion.position_m),
    )


def _camera(camera: engine.Camera) -> Camera:
    """For the wire: the lens is that of the clip's frames, which may be smaller than those it was measured in."""
    from service.wire.venue import Camera
    from worker.jobs.wire import wire_lens, wire_pose

    return Camera(
        id=camera.id,
        image_size=list(camera.intrinsics.size),
        intrinsics=wire_lens(camera.intrinsics),
        pose=wire_pose(camera.pose),
    )
