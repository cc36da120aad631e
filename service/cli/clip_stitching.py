"""Clips stitched on this machine: the engine's part of `esc stitch`, and the report of the clip that it wrote.

Imports the engine, see `local_engine`.
"""

import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from service.cli.printing import FAILED, fail, print_note
from service.cli.progress import progress_bar
from service.cli.tracked_poses import motion_document, print_motions, tracking
from service.schemas.venue import Venue
from service.schemas.view import ViewChoice
from worker.calibration.stitching.coverage import Unseen
from worker.jobs.from_schemas import camera_of, choice_of, light_of, pitch_of
from worker.video.errors import VideoError
from worker.video.stitch import Plan, StaticGeometry, StitchReport, StitchScene, stitch
from worker.video.tracking import MotionSummary

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
            tracked = stack.enter_context(tracking(venue, track_every or 1, poses, freed_axes))
            show = stack.enter_context(progress_bar())
            geometry = StaticGeometry if track_every is None else tracked
            report = stitch(scene, addresses, plan, show, geometry, _print_unseen)
    except VideoError as fault:
        fail(str(fault), FAILED)
    _print_summary(report)
    print_motions(tracked.motions)
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
            | ({"followed": motion_document(motions[camera])} if camera in motions else {})
            for camera, offset in report.offsets.items()
        },
    }
