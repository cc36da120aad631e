"""What commands are given: options that many of them have, and how their values are read."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from service.cli.printing import FAILED, USAGE, fail
from service.schemas.names import ID_IN_WORDS, ID_PATTERN, JOB_ID_PATTERN, FieldNumber, FormatName, LensChoice

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.schemas.options import Options
    from service.schemas.venue import Venue
    from service.settings import Settings

M = TypeVar("M", bound="BaseModel")
DEFAULT_URL = "http://127.0.0.1:8000"


def _or_from_env_file(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """What is given on the command line or in the environment, or else in `.env`, or else the default."""
    name = option.name or ""
    source = context.get_parameter_source(name)
    if (source is not None and source.name != "DEFAULT") or not Path(".env").is_file():
        return value
    from service.cli.env_file import EnvFile

    in_file: str | None = getattr(EnvFile(), name)
    return in_file or value


def _api_key(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """A key read from a file brings its line end along; what else no header takes is told here, not by the socket."""
    key = _key_from_secret_file(context, option) or _or_from_env_file(context, option, value)
    if key is None:
        return None
    if not re.fullmatch(r"[\x21-\x7e]+", key.strip()):
        raise typer.BadParameter("a key is letters, digits and signs, without spaces")
    return key.strip()


def _key_from_secret_file(context: typer.Context, option: typer.CallbackParam) -> str | None:
    """The key in the file that ESC_API_KEY_FILE names; what is given on the command line goes before it."""
    source = context.get_parameter_source(option.name or "")
    if source is not None and source.name == "COMMANDLINE":
        return None
    from service.secret_files import SecretFileError, read_secret

    try:
        return read_secret("ESC_API_KEY", os.environ)
    except SecretFileError as error:
        raise typer.BadParameter(str(error)) from None


def _check_venue_id(venue_id: str) -> str:
    if not re.fullmatch(ID_PATTERN, venue_id):
        raise typer.BadParameter(f"{venue_id!r} is no id: {ID_IN_WORDS}, such as esc venue list prints")
    return venue_id


def _check_job_id(job_id: str) -> str:
    if not re.fullmatch(JOB_ID_PATTERN, job_id):
        raise typer.BadParameter(f"{job_id!r} is no id: 26 capital letters and digits, such as esc job list prints")
    return job_id


def _check_optional_venue_id(camera_id: str | None) -> str | None:
    return None if camera_id is None else _check_venue_id(camera_id)


def _check_optional_job_id(job_id: str | None) -> str | None:
    return None if job_id is None else _check_job_id(job_id)


def require_folder_of(file: Path) -> Path:
    """Refuse a file to write whose folder is missing, before anything is computed for it."""
    if not file.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {file.parent}: make it first")
    return file


Url = Annotated[
    str,
    typer.Option(
        "--url", envvar="ESC_URL", callback=_or_from_env_file, help="Address of the service; .env may have it too."
    ),
]
ApiKey = Annotated[
    str | None,
    typer.Option(
        "--api-key",
        envvar="ESC_API_KEY",
        callback=_api_key,
        metavar="KEY",
        help="API key for the service, as `esc key add` printed it; .env may have it too, or the file that "
        "ESC_API_KEY_FILE names.",
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
    typer.Argument(metavar="VENUE", callback=_check_venue_id, help="Id of a venue, as `esc venue list` prints it."),
]
JobId = Annotated[
    str, typer.Argument(metavar="JOB", callback=_check_job_id, help="Id of a job, as `esc job list` prints it.")
]
AdoptedCamera = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMERA]",
        callback=_check_optional_venue_id,
        help="Id of the camera whose lens is stored, as `esc venue list` prints it.",
    ),
]
AdoptedField = Annotated[
    FieldNumber | None, typer.Option("--field", help="Instead of a lens: a number of the field, with --job.")
]
AdoptedJob = Annotated[
    str | None,
    typer.Option("--job", metavar="JOB", callback=_check_optional_job_id, help="The calibration whose lines have it."),
]
Frames = Annotated[
    list[str],
    typer.Argument(
        metavar="CAMERA=FILE...",
        help="A JPEG or PNG of each camera, such as left=left.jpg; several of one camera are fused.",
    ),
]
AdoptedFinding = Annotated[
    str | None,
    typer.Option(
        "--found",
        metavar="JOB",
        callback=_check_optional_job_id,
        help="Instead of a lens: the cameras that this job of `esc venue find` has found.",
    ),
]
CalibrateFound = Annotated[
    bool,
    typer.Option("--calibrate", help="With --found: then calibrate the venue with the frames of that job."),
]
Candidates = Annotated[
    list[str] | None,
    typer.Option(
        "--candidate",
        metavar="CAMERA=NUMBER",
        help="With --found: the candidate that a camera is taken to be, from 1; 0: none of them. Otherwise the first "
        "one, of cameras that were accepted.",
    ),
]
FormatOption = Annotated[
    FormatName,
    typer.Option(
        "--format", help="File format: json is ESC's own, the others are those of the tools they are named after."
    ),
]
LensOption = Annotated[
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
AnswerAsJson = Annotated[
    bool, typer.Option("--json", help="Print JSON at a terminal too; what goes to a file or a pipe is JSON anyway.")
]
Yes = Annotated[
    bool, typer.Option("--yes", help="Do not ask; without a terminal, where nobody can be asked, it is required.")
]
IdempotencyKey = Annotated[
    str | None,
    typer.Option("--idempotency-key", metavar="KEY", help="Any word: sent twice with the same word, it is one job."),
]
OptionsText = Annotated[
    str,
    typer.Option(
        "--options",
        metavar="JSON",
        help='Options of the calibration: {"dry_run": true} moves no stored pose, {"priority": "live"} goes first, '
        '{"timeout_s": 60} ends it after so many seconds; all are in /docs of a service.',
    ),
]


def require_yes(yes: bool, question: str) -> None:
    """End, unless somebody said yes to what cannot be undone: with --yes, or asked at a terminal."""
    if yes:
        return
    if not sys.stdin.isatty():
        fail(f"Nothing was deleted. {question}? There is no terminal to ask at: confirm with --yes.", USAGE)
    if not typer.confirm(f"{question}? It cannot be undone", err=True):
        fail("Nothing was deleted.", FAILED)


def load_settings(**given: Any) -> Settings:
    """The settings, those given on the command line before all others; with them the log is set up."""
    from pydantic import ValidationError
    from pydantic_settings import SettingsError

    from service.observability import logs
    from service.schemas.findings import describe_errors
    from service.secret_files import SecretFileError, bucket_credentials
    from service.settings import Settings

    _refuse_unread_variables()
    try:
        bucket_credentials(os.environ)
        settings = Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        told = [message.partition(": ") for message in describe_errors(error.errors(), None, None)]
        options = {name for name, value in given.items() if value is not None}
        names = [f"--{name.removeprefix('worker_')}" if name in options else f"ESC_{name.upper()}" for name, *_ in told]
        fail("\n".join(f"{name}: {message}" for name, (*_, message) in zip(names, told, strict=True)), USAGE)
    except SettingsError as error:
        # Of a list that is no JSON; the error names its field and nothing else.
        name = str(error).partition('field "')[2].partition('"')[0].upper()
        fail(f'ESC_{name}: expected a list in JSON, for instance ["127.0.0.1"]', USAGE)
    except SecretFileError as error:
        fail(str(error), USAGE)
    logs.configure(settings)
    return settings


def _refuse_unread_variables() -> None:
    """End where a variable `ESC_...` is no setting: what it was to change would stay as it is, in silence."""
    from service.settings import setting_names, unread_variables
    from service.variable_names import OF_CLIENTS, suggestion

    known = setting_names() | OF_CLIENTS
    meant = {name: suggestion(name, known) for name in unread_variables()}
    lines = [
        f"unknown setting {name}: " + (f"did you mean {near}?" if near else "docs/settings.md has those there are")
        for name, near in meant.items()
    ]
    if lines:
        fail("\n".join(lines), USAGE)


def parse_frame_files(frames: Sequence[str]) -> dict[str, list[Path]]:
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


def parse_candidates(choices: Sequence[str]) -> dict[str, int | None]:
    """The candidate of each camera, of arguments CAMERA=NUMBER; None: none of them."""
    chosen: dict[str, int | None] = {}
    for choice in choices:
        camera, equals, number = choice.partition("=")
        if not (camera and equals and number.isdecimal()):
            fail(f"{choice!r} is not CAMERA=NUMBER, for instance right=2", USAGE)
        chosen[camera] = int(number) or None
    return chosen


def parse_options(text: str) -> Options:
    """What --options says."""
    from service.schemas.options import Options

    return parse_document(Options, text, "--options")


def parse_document(model: type[M], document: str | bytes, source: str, example: str = "") -> M:
    """A model from its JSON, which may be any file's content; `source` says whose fault it is if it is none.

    `example`: a document of the form that was expected, shown behind what is wrong.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate_json(document)
    except ValidationError as error:
        from service.schemas.findings import describe_errors

        found = error.errors()
        is_json = all(finding["type"] != "json_invalid" for finding in found)
        told = describe_errors(found, model, json.loads(document) if is_json else None)
        lines = [f"{source}: {message}" for message in told]
        fail("\n".join([*lines, f"Expected is {example}"] if example else lines), USAGE)


def require_cameras(venue: Venue, named: Iterable[str]) -> None:
    """End the command unless the venue has every camera that is named."""
    known = [camera.id for camera in venue.cameras]
    if unknown := [camera for camera in dict.fromkeys(named) if camera not in known]:
        fail(f"The venue has no camera {', '.join(unknown)}; it has {', '.join(known)}", USAGE)


def parse_by_camera(arguments: Sequence[str], form: str) -> dict[str, str]:
    """Return what CAMERA=VALUE arguments say of each camera; `form`: what is expected, in words."""
    found: dict[str, str] = {}
    for argument in arguments:
        camera, equals, value = argument.partition("=")
        if not (camera and equals and value):
            fail(f"{argument!r} is not {form}", USAGE)
        if camera in found:
            fail(f"camera {camera} is given twice", USAGE)
        found[camera] = value
    return found
