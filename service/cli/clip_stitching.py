"""Clips stitched on this machine: the engine's part of `esc stitch`, the report of the clip, and poses beside it.

Imports the engine, see `local_engine`.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from service.cli.printing import FAILED, fail, print_note
from service.cli.progress import progress_bar
from service.formats.clip import ClipPoses, TrackedCamera
from service.formats.lens import NumberedCamera
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.schemas.view import ViewChoice
from worker.calibration.stitching.coverage import Unseen
from worker.calibration.tracking.follower import TrackedMoment, TrackedPose
from worker.jobs.from_schemas import camera_of, choice_of, light_of, pitch_of
from worker.jobs.to_schemas import posed_camera_to_schema
from worker.video.errors import VideoError
from worker.video.stitch import Plan, StaticGeometry, StitchReport, StitchScene, stitch
from worker.video.tracking import MotionSummary, TrackedGeometryFactory

# A smaller part of the view that no camera sees is not worth a line.
LEAST_UNSEEN = 0.001


def stitch_clips(
    venue: Venue,
    addresses: Mapping[str, str],
    plan: Plan,
    view: Mapping[str, Any],
    track_every: int | None,
    poses: Path | None,
    freed_axes: str,
    *,
    as_json: bool,
) -> None:
    """Stitch the clips at `addresses`, by camera, and print a report; exit with a line where it fails.

    `view`: values that replace those of the venue's view, None: as suits the cameras. `track_every`: cameras are
    tracked and measured in every so many-th picture, None: they stand still. `poses`: the stem of files for tracked
    poses.
    """
    lights = {camera: light_of(light) for camera, light in venue.lights.items()}
    cameras = [camera_of(camera) for camera in venue.cameras]
    choice = replace(choice_of(venue.view or ViewChoice()), **view)
    scene = StitchScene(pitch_of(venue.field), cameras, choice, lights or None)
    try:
        with ExitStack() as stack:
            tracked = stack.enter_context(_tracking(venue, track_every or 1, poses, freed_axes))
            show = stack.enter_context(progress_bar())
            geometry = StaticGeometry if track_every is None else tracked
            report = stitch(scene, addresses, plan, show, geometry, _print_unseen)
    except VideoError as fault:
        fail(str(fault), FAILED)
    _print_summary(report)
    _print_motions(tracked.motions)
    if as_json:
        print(json.dumps(_json_document(report, plan.output, tracked.motions), indent=2))


def _print_unseen(unseen: Unseen) -> None:
    """Print which part of the view will be dark; in a live stream nobody would learn it at the end."""
    if unseen.share >= LEAST_UNSEEN:
        print_note(
            f"{100 * unseen.share:.1f} % of the view is seen by no camera: {', '.join(unseen.places)}. "
            "--height auto and --field-of-view auto show what cameras see"
        )


def _print_summary(report: StitchReport) -> None:
    """Print size, speed, offsets and faults of the clip that was made."""
    width, height = report.size
    print_note(
        f"{report.frames} pictures of {width}x{height}, {report.seconds:.2f} s at {float(report.rate):.6g} a second, "
        f"in {report.took_s:.1f} s ({report.frames / report.took_s:.1f} fps)"
    )
    for camera, found in report.found.items():
        print_note(
            f"The clip of camera {camera} began {report.offsets[camera]:+.3f} s after the first: found by what moves, "
            f"likeness {found.strength:.2f}, at the next best offset {found.rival:.2f}"
        )
    for camera, at in report.ended.items():
        print_note(f"The clip of camera {camera} ended early, at {at:.2f} s")
    for camera, count in report.broken.items():
        if count:
            print_note(
                f"{count} frames of camera {camera} could not be decoded; {report.repeated[camera]} pictures show the "
                "nearest good one in their place"
            )


def _json_document(report: StitchReport, output: str, motions: Mapping[str, MotionSummary]) -> dict[str, Any]:
    return {
        "output": output,
        "width_px": report.size[0],
        "height_px": report.size[1],
        "rate": str(report.rate),
        "frames": report.frames,
        "seconds": round(report.seconds, 6),
        "took_s": round(report.took_s, 3),
        "fps": round(report.frames / report.took_s, 3),
        "cameras": {
            camera: {
                "offset_s": round(offset, 6),
                "offset_found": camera in report.found,
                "likeness": round(report.found[camera].strength, 4) if camera in report.found else None,
                "ended_s": report.ended.get(camera),
                "broken_frames": report.broken[camera],
                "repeated": report.repeated[camera],
            }
            | ({"followed": _motion_document(motions[camera])} if camera in motions else {})
            for camera, offset in report.offsets.items()
        },
    }


@contextmanager
def _tracking(venue: Venue, every: int, stem: Path | None, freed_axes: str) -> Iterator[TrackedGeometryFactory]:
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


def _print_motions(motions: Mapping[str, MotionSummary]) -> None:
    """Print the largest turn of each camera and how its pictures were measured."""
    for camera, motion in motions.items():
        unseen = motion.how["coasted"], motion.how["refused"]
        print_note(
            f"Camera {camera} turned by up to {motion.farthest_deg:.2f} degrees from its first picture; lines measured "
            f"in {motion.how['measured']} of {motion.how.total()} pictures, not seen or not looked for in {unseen[0]}, "
            f"not believed in {unseen[1]}"
        )


def _motion_document(motion: MotionSummary) -> dict[str, Any]:
    """Return a summary of the movement of a camera for JSON."""
    return {
        "farthest_deg": round(motion.farthest_deg, 4),
        **{how: motion.how[how] for how in ("measured", "coasted", "refused")},
    }


def _tracked_camera(followed: TrackedPose, stored: NumberedCamera) -> TrackedCamera:
    sigma, motion = followed.sigma, followed.motion_sigma
    return TrackedCamera(
        replace(stored, camera=posed_camera_to_schema(followed.camera)),
        followed.how,
        (sigma.rotation_deg, sigma.position_m),
        (motion.rotation_deg, motion.position_m),
    )
