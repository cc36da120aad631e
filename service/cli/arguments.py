"""What commands are given: options that many of them have, and how their values are read."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from service.cli.printing import USAGE, fail
from service.wire.names import ID_PATTERN, JOB_ID_PATTERN, FormatName, LensChoice

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.settings import Settings
    from service.wire.options import Options

M = TypeVar("M", bound="BaseModel")
LOCAL = "http://127.0.0.1:8000"


def _or_as_the_file_says(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """What is given on the command line or in the environment, or else in `.env`, or else the default."""
    name = option.name or ""
    source = context.get_parameter_source(name)
    if (source is not None and source.name != "DEFAULT") or not Path(".env").is_file():
        return value
    from service.cli.env_file import Service

    in_file: str | None = getattr(Service(), name)
    return in_file or value


def _as_header(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """A key read from a file brings its line end along; what else no header takes is told here, not by the socket."""
    key = _or_as_the_file_says(context, option, value)
    if key is None:
        return None
    if not re.fullmatch(r"[\x21-\x7e]+", key.strip()):
        raise typer.BadParameter("a key is letters, digits and signs, without spaces")
    return key.strip()


def _is_of_a_venue(venue_id: str) -> str:
    if not re.fullmatch(ID_PATTERN, venue_id):
        raise typer.BadParameter(f"{venue_id!r} is no id: up to 64 of a-z, 0-9, - and _, such as esc venue list prints")
    return venue_id


def _is_of_a_job(job_id: str) -> str:
    if not re.fullmatch(JOB_ID_PATTERN, job_id):
        raise typer.BadParameter(f"{job_id!r} is no id: 26 capital letters and digits, such as esc job list prints")
    return job_id


Url = Annotated[
    str,
    typer.Option(
        "--url", envvar="ESC_URL", callback=_or_as_the_file_says, help="Address of the service; .env may have it too."
    ),
]
ApiKey = Annotated[
    str | None,
    typer.Option(
        "--api-key",
        envvar="ESC_API_KEY",
        callback=_as_header,
        metavar="KEY",
        help="API key for the service, as `esc key add` printed it; .env may have it too.",
    ),
]
Data = Annotated[
    Path | None,
    typer.Option("--data", help="Folder of the service's database, frames and pictures (ESC_DATA) [default: esc-data]"),
]
Host = Annotated[
    str | None,
    typer.Option("--host", help="Address to listen on; 0.0.0.0: all of this machine (ESC_HOST) [default: 127.0.0.1]"),
]
Port = Annotated[
    int | None, typer.Option("--port", help="Port to listen on; 0 takes a free one (ESC_PORT) [default: 8000]")
]
VenueId = Annotated[
    str,
    typer.Argument(metavar="VENUE", callback=_is_of_a_venue, help="Id of a venue, as `esc venue list` prints it."),
]
CameraId = Annotated[
    str,
    typer.Argument(metavar="CAMERA", callback=_is_of_a_venue, help="Id of a camera, as `esc venue list` prints it."),
]
JobId = Annotated[
    str, typer.Argument(metavar="JOB", callback=_is_of_a_job, help="Id of a job, as `esc job list` prints it.")
]
Frames = Annotated[
    list[str],
    typer.Argument(
        metavar="CAMERA=FILE...",
        help="A JPEG or PNG of each camera, such as left=left.jpg; several of one camera are fused.",
    ),
]
Form = Annotated[
    FormatName,
    typer.Option(
        "--format", help="File format: json is ESC's own, the others are those of the tools they are named after."
    ),
]
Lens = Annotated[
    LensChoice,
    typer.Option(
        "--lens",
        help="stored: the poses for the lenses that the venue has; refined: poses and lenses as the lines have both.",
    ),
]
OneCamera = Annotated[
    str | None, typer.Option("--camera", metavar="CAMERA", help="Id of the one camera that is wanted; otherwise all.")
]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="File to write; otherwise standard output.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON in place of lines.")]
OptionsText = Annotated[
    str,
    typer.Option(
        "--options",
        metavar="JSON",
        help='Options of the calibration: {"dry_run": true} moves no stored pose, {"priority": "live"} goes first, '
        '{"timeout_s": 60} ends it after so many seconds; all are in /docs of a service.',
    ),
]


def settings_of(**given: Any) -> Settings:
    """The settings, those given on the command line before all others; with them the log is set up."""
    from pydantic import ValidationError

    from service.observe import logs
    from service.settings import Settings

    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        fail("\n".join(f"ESC_{'.'.join(map(str, e['loc'])).upper()}: {e['msg']}" for e in error.errors()), USAGE)
    logs.configure(settings)
    return settings


def files_of(frames: Sequence[str]) -> dict[str, list[Path]]:
    """Files by camera, of arguments CAMERA=FILE."""
    files: dict[str, list[Path]] = {}
    for frame in frames:
        camera, equals, name = frame.partition("=")
        if not (camera and equals and name):
            fail(f"{frame!r} is not CAMERA=FILE, for instance left=left.jpg", USAGE)
        if not Path(name).is_file():
            fail(f"There is no file {name} (camera {camera})", USAGE)
        files.setdefault(camera, []).append(Path(name))
    return files


def options_of(text: str) -> Options:
    """What --options says."""
    from service.wire.options import Options

    return checked(Options, text, "--options")


def checked(model: type[M], document: str | bytes, source: str) -> M:
    """A model from its JSON, which may be any file's content; `source` says whose fault it is if it is none."""
    from pydantic import ValidationError

    try:
        return model.model_validate_json(document)
    except ValidationError as error:
        from service.wire.findings import in_words

        found = error.errors()
        is_json = all(finding["type"] != "json_invalid" for finding in found)
        told = in_words(found, model, json.loads(document) if is_json else None)
        fail("\n".join(f"{source}: {message}" for message in told), USAGE)
