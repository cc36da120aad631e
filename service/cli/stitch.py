"""`esc stitch`: clips of a venue's cameras become one clip of the stitched view, on this machine."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from service.cli.arguments import (
    DEFAULT_URL,
    ApiKey,
    AsJson,
    FieldOfView,
    FollowEvery,
    Height,
    Horizon,
    ProjectionOption,
    Url,
    VenueOrFile,
    parse_by_camera,
    parse_frame_rate,
)
from service.cli.local_engine import engine_settings
from service.cli.printing import USAGE, fail
from service.cli.service_client import load_venue

# In place of a number: as it suits the cameras, whatever the venue keeps.
AUTO = "auto"


def stitch(
    venue: VenueOrFile,
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
            metavar="CAMERA=SECONDS",
            help="How much later a camera's clip began than the first one: right=0.120, or in frames of its own, "
            "right=3f. Otherwise found by what moves where both see, or by the clocks of cameras (RTSP).",
        ),
    ] = None,
    audio: Annotated[
        str | None,
        typer.Option(metavar="CAMERA|none", help="Camera whose sound is kept; default: the first clip with sound."),
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option(metavar="FPS", help="Pictures a second, 25 or 30000/1001; otherwise those of the first clip."),
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="Begin at this time: seconds, or hours:minutes:seconds."),
    ] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="TIME", help="End at this time.")] = None,
    allow_missing: Annotated[
        bool,
        typer.Option("--allow-missing", help="Go on without cameras whose clip is missing or has ended."),
    ] = False,
    projection: ProjectionOption = None,
    width: Annotated[int | None, typer.Option(min=64, max=8192, help="In pixels, even.")] = None,
    height: Height = None,
    field_of_view: FieldOfView = None,
    pan: Annotated[float | None, typer.Option(min=-180, max=180, help="To the right, in degrees.")] = None,
    horizon: Horizon = None,
    codec: Annotated[str, typer.Option(help="Encoder, any that PyAV has.")] = "libx264",
    crf: Annotated[int, typer.Option(min=0, max=51, help="Quality of libx264 and libx265, 0 loses nothing.")] = 20,
    preset: Annotated[str, typer.Option(help="Preset of libx264 and libx265, ultrafast to veryslow.")] = "veryfast",
    seam: Annotated[
        Literal["static", "people"],
        typer.Option(help="Seams stay where they are, or go around people, whom one camera shows whole."),
    ] = "static",
    follow: Annotated[
        bool, typer.Option("--follow", help="Cameras shake: find where each is in every picture, by its lines.")
    ] = False,
    follow_every: FollowEvery = 1,
    poses_out: Annotated[
        Path | None,
        typer.Option(
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
    pictures = None if rate is None else parse_frame_rate(rate, "pictures")
    if (poses_out is not None or follow_every > 1) and not follow:
        fail("--poses-out and --follow-every go with --follow", USAGE)
    offsets = {
        camera: (_parse_number(text.removesuffix("f"), f"--offset {camera}={text}"), text.endswith("f"))
        for camera, text in parse_by_camera(
            offset or [], "CAMERA=SECONDS, for instance right=0.120 or right=3f"
        ).items()
    }
    view: dict[str, Any] = {
        "projection": projection,
        "width": width,
        "height": _parse_number_or_auto(height, "--height", 64, 8192),
        "field_of_view_deg": _parse_number_or_auto(field_of_view, "--field-of-view", 5, 340),
        "pan_deg": pan,
        "horizon": _parse_number_or_auto(horizon, "--horizon", -3, 3),
    }
    if any(isinstance(view[side], float | int) and view[side] % 2 for side in ("width", "height")):
        fail("--width and --height are even numbers: video takes no others", USAGE)
    stored = load_venue(venue, url, api_key)
    settings = engine_settings()
    from service.cli import clip_stitching
    from worker.video.encoding import Encoding
    from worker.video.stitch import Offset, Plan

    plan = Plan(
        output,
        {camera: Offset(*offset) for camera, offset in offsets.items()},
        pictures,
        begin_s,
        end_s,
        audio,
        allow_missing,
        Encoding(codec, crf, preset),
        seam,
    )
    changes = {name: None if value == AUTO else value for name, value in view.items() if value is not None}
    clip_stitching.stitch_clips(
        stored,
        addresses,
        plan,
        changes,
        follow_every if follow else None,
        poses_out,
        settings.freed_axes,
        as_json=as_json,
    )


def _parse_seconds(text: str) -> float:
    """Return the seconds of a time: seconds, minutes:seconds or hours:minutes:seconds."""
    total = 0.0
    for part in text.split(":"):
        total = 60 * total + _parse_number(part, f"the time {text!r}")
    return total


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
