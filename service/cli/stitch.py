"""`esc stitch`: clips of a venue's cameras become one clip of the stitched view, on this machine."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.arguments import DEFAULT_URL, ApiKey, AsJson, Url, parse_by_camera
from service.cli.printing import FAILED, USAGE, fail, print_note, progress_bar
from service.cli.service_client import load_venue
from service.schemas.names import Projection

if TYPE_CHECKING:
    from service.schemas.venue import Venue
    from worker.calibration.stitching.coverage import Unseen
    from worker.calibration.stitching.views import ViewChoice
    from worker.video.stitch import Offset, StitchReport, StitchScene
    from worker.video.tracking import MotionSummary

# In place of a number: as it suits the cameras, whatever the venue keeps.
AUTO = "auto"
# Less of the view that no camera sees is not worth a line.
LEAST_UNSEEN = 0.001


def stitch(
    venue: Annotated[
        str,
        typer.Argument(metavar="VENUE", help="Id of a venue of the service, or the JSON file of one."),
    ],
    clips: Annotated[
        list[str],
        typer.Argument(
            metavar="CAMERA=CLIP...",
            help="A clip of each camera, such as left=left.mp4: a file, or the address of a stream (rtsp://...). Times "
            "are those of the first one.",
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="CLIP",
            help="File to write (.mp4, .mov, .mkv, .ts), or where to send it: rtsp://, rtmp://, srt://, udp://.",
        ),
    ],
    offset: Annotated[
        list[str] | None,
        typer.Option(
            "--offset",
            metavar="CAMERA=SECONDS",
            help="How much later a camera's clip began than the first one: right=0.120, or in frames of its own, "
            "right=3f. Otherwise found by what moves where both see, or told by the clocks of cameras (RTSP).",
        ),
    ] = None,
    audio: Annotated[
        str | None,
        typer.Option(
            "--audio", metavar="CAMERA|none", help="Whose sound is kept; otherwise that of the first clip that has any."
        ),
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option(
            "--rate", metavar="FPS", help="Pictures a second, 25 or 30000/1001; otherwise those of the first clip."
        ),
    ] = None,
    begin: Annotated[
        str | None, typer.Option("--from", metavar="TIME", help="Where to begin: seconds, or hours:minutes:seconds.")
    ] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="TIME", help="Where to end.")] = None,
    allow_missing: Annotated[
        bool,
        typer.Option(
            "--allow-missing", help="Without a camera whose clip is not given or has ended, go on with others."
        ),
    ] = False,
    projection: Annotated[
        Projection | None, typer.Option("--projection", help="How the picture is spread out; birds-eye: from above.")
    ] = None,
    width: Annotated[int | None, typer.Option("--width", min=64, max=8192, help="In pixels, even.")] = None,
    height: Annotated[str | None, typer.Option("--height", help="In pixels, even, or auto.")] = None,
    field_of_view: Annotated[str | None, typer.Option("--field-of-view", help="In degrees, or auto.")] = None,
    pan: Annotated[float | None, typer.Option("--pan", min=-180, max=180, help="To the right, in degrees.")] = None,
    horizon: Annotated[str | None, typer.Option("--horizon", help="0: at the top, 1: at the bottom, or auto.")] = None,
    codec: Annotated[str, typer.Option("--codec", help="Encoder, any that PyAV has.")] = "libx264",
    crf: Annotated[
        int, typer.Option("--crf", min=0, max=51, help="Quality of libx264 and libx265, 0 loses nothing.")
    ] = 20,
    preset: Annotated[
        str, typer.Option("--preset", help="Of libx264 and libx265, ultrafast to veryslow.")
    ] = "veryfast",
    follow: Annotated[
        bool,
        typer.Option("--follow", help="Cameras shake: find where each is in every picture, by its lines."),
    ] = False,
    follow_every: Annotated[
        int, typer.Option("--follow-every", min=1, max=25, metavar="N", help="Measure in every Nth picture only.")
    ] = 1,
    poses_out: Annotated[
        Path | None,
        typer.Option(
            "--poses-out",
            metavar="STEM",
            help="With --follow: the poses of every picture, as STEM.jsonl (OpenTrackIO), STEM.d1 (FreeD), STEM.csv.",
        ),
    ] = None,
    as_json: AsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Stitch clips into one, on this machine. Needs the extra `video`. Exit: 0 made, 1 failed, 2 usage."""
    addresses = parse_by_camera(clips, "CAMERA=CLIP, for instance left=left.mp4")
    begin_s, end_s = (None if time is None else _parse_seconds(time) for time in (begin, end))
    pictures = None if rate is None else _parse_rate(rate)
    if (poses_out is not None or follow_every > 1) and not follow:
        fail("--poses-out and --follow-every go with --follow", USAGE)
    chosen: dict[str, Any] = {
        "projection": projection,
        "width": width,
        "height": _parse_number_or_auto(height, "--height", 64, 8192),
        "field_of_view_deg": _parse_number_or_auto(field_of_view, "--field-of-view", 5, 340),
        "pan_deg": pan,
        "horizon": _parse_number_or_auto(horizon, "--horizon", -3, 3),
    }
    if any(isinstance(chosen[side], float | int) and chosen[side] % 2 for side in ("width", "height")):
        fail("--width and --height are even numbers: video takes no others", USAGE)
    stored = load_venue(venue, url, api_key)

    from service.cli.local_engine import engine_settings

    settings = engine_settings()
    from service.cli.tracked_poses import print_motions, tracking
    from worker.video.encoding import Encoding
    from worker.video.errors import VideoError
    from worker.video.stitch import Plan, StaticGeometry
    from worker.video.stitch import stitch as stitched

    plan = Plan(
        output,
        _parse_offsets(offset or []),
        pictures,
        begin_s,
        end_s,
        audio,
        allow_missing,
        Encoding(codec, crf, preset),
    )
    try:
        with ExitStack() as stack:
            follows = stack.enter_context(tracking(stored, follow_every, poses_out, settings.freed_axes))
            show = stack.enter_context(progress_bar())
            geometry = follows if follow else StaticGeometry
            made = stitched(_stitch_inputs(stored, chosen), addresses, plan, show, geometry, _print_unseen)
    except VideoError as fault:
        fail(str(fault), FAILED)
    _print_summary(made)
    print_motions(follows.motions)
    if as_json:
        print(json.dumps(_json_document(made, output, follows.motions), indent=2))


def _parse_offsets(given: Sequence[str]) -> dict[str, Offset]:
    from worker.video.stitch import Offset

    offsets = {}
    for camera, text in parse_by_camera(given, "CAMERA=SECONDS, for instance right=0.120 or right=3f").items():
        number = _parse_number(text.removesuffix("f"), f"--offset {camera}={text}")
        offsets[camera] = Offset(number, text.endswith("f"))
    return offsets


def _parse_seconds(text: str) -> float:
    """Of seconds, minutes:seconds or hours:minutes:seconds."""
    total = 0.0
    for part in text.split(":"):
        total = 60 * total + _parse_number(part, f"the time {text!r}")
    return total


def _parse_rate(text: str) -> Fraction:
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not 0 < rate <= 1000:
        fail(f"--rate {text}: pictures a second, such as 25, 29.97 or 30000/1001", USAGE)
    return rate


def _parse_number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        fail(f"{where}: {text!r} is no number", USAGE)
    return number


def _parse_number_or_auto(text: str | None, option: str, least: float, most: float) -> float | str | None:
    if text is None or text == AUTO:
        return text
    number = _parse_number(text, option)
    if not least <= number <= most:
        fail(f"{option} {text}: from {least:g} to {most:g}, or {AUTO}", USAGE)
    return int(number) if number.is_integer() else number


def _stitch_inputs(venue: Venue, chosen: Mapping[str, Any]) -> StitchScene:
    from worker.jobs.from_schemas import camera_of, light_of, pitch_of
    from worker.video.stitch import StitchScene

    given: dict[str, Any] = {
        name: None if value == AUTO else value for name, value in chosen.items() if value is not None
    }
    lights = {camera: light_of(light) for camera, light in venue.lights.items()}
    cameras = [camera_of(camera) for camera in venue.cameras]
    return StitchScene(pitch_of(venue.field), cameras, replace(_stored_view(venue), **given), lights or None)


def _stored_view(venue: Venue) -> ViewChoice:
    """What the venue itself wants to show."""
    from service.schemas.view import ViewChoice as Kept
    from worker.jobs.from_schemas import choice_of

    return choice_of(venue.view or Kept())


def _print_unseen(unseen: Unseen) -> None:
    """Say at the beginning what will be dark, which in a live stream nobody would learn at its end."""
    if unseen.share >= LEAST_UNSEEN:
        print_note(
            f"{100 * unseen.share:.1f} % of the view is seen by no camera: {', '.join(unseen.places)}. "
            "--height auto and --field-of-view auto show what cameras see"
        )


def _print_summary(made: StitchReport) -> None:
    """Lines for whoever looks."""
    width, height = made.size
    print_note(
        f"{made.frames} pictures of {width}x{height}, {made.seconds:.2f} s at {float(made.rate):.6g} a second, "
        f"in {made.took_s:.1f} s ({made.frames / made.took_s:.1f} fps)"
    )
    for camera, found in made.found.items():
        print_note(
            f"The clip of camera {camera} began {made.offsets[camera]:+.3f} s after the first: found by what moves, "
            f"likeness {found.strength:.2f}, at the next best offset {found.rival:.2f}"
        )
    for camera, at in made.ended.items():
        print_note(f"The clip of camera {camera} ended early, at {at:.2f} s")
    for camera, count in made.broken.items():
        if count:
            print_note(
                f"{count} frames of camera {camera} could not be decoded; {made.repeated[camera]} pictures show the "
                "nearest good one in their place"
            )


def _json_document(made: StitchReport, output: str, motions: Mapping[str, MotionSummary]) -> dict[str, Any]:
    from service.cli.tracked_poses import motion_document

    return {
        "output": output,
        "width_px": made.size[0],
        "height_px": made.size[1],
        "rate": str(made.rate),
        "frames": made.frames,
        "seconds": round(made.seconds, 6),
        "took_s": round(made.took_s, 3),
        "fps": round(made.frames / made.took_s, 3),
        "cameras": {
            camera: {
                "offset_s": round(offset, 6),
                "offset_found": camera in made.found,
                "likeness": round(made.found[camera].strength, 4) if camera in made.found else None,
                "ended_s": made.ended.get(camera),
                "broken_frames": made.broken[camera],
                "repeated": made.repeated[camera],
            }
            | ({"followed": motion_document(motions[camera])} if camera in motions else {})
            for camera, offset in made.offsets.items()
        },
    }
