"""Arguments and options that several commands share, and how their values are parsed."""

import json
import os
import re
import sys
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from pydantic import BaseModel, ValidationError

from service.cli.printing import FAILED, USAGE, fail
from service.schemas.field import FieldOfPlay
from service.schemas.findings import describe_errors
from service.schemas.names import ID_IN_WORDS, ID_PATTERN, JOB_ID_PATTERN, FormatName, LensChoice, Projection
from service.schemas.options import Options
from service.schemas.venue import Venue
from service.secret_files import SecretFileError, read_secret

M = TypeVar("M", bound=BaseModel)
HIGHEST_RATE = 1000
DEFAULT_URL = "http://127.0.0.1:8000"


def _or_from_env_file(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """Return the value of the command line or the environment, else that of `.env`, else the default."""
    name = option.name or ""
    source = context.get_parameter_source(name)
    if (source is not None and source.name != "DEFAULT") or not Path(".env").is_file():
        return value
    # pydantic-settings takes longer to load than a command takes to run.
    from service.cli.env_file import EnvFile

    in_file: str | None = getattr(EnvFile(), name)
    return in_file or value


def _api_key(context: typer.Context, option: typer.CallbackParam, value: str | None) -> str | None:
    """Return the key without the line end that a file gives it; refuse what a header cannot have."""
    key = _key_from_secret_file(context, option) or _or_from_env_file(context, option, value)
    if key is None:
        return None
    if not re.fullmatch(r"[\x21-\x7e]+", key.strip()):
        raise typer.BadParameter("a key is letters, digits and signs, without spaces")
    return key.strip()


def _key_from_secret_file(context: typer.Context, option: typer.CallbackParam) -> str | None:
    """Return the key in the file that ESC_API_KEY_FILE names, unless the command line has one."""
    source = context.get_parameter_source(option.name or "")
    if source is not None and source.name == "COMMANDLINE":
        return None
    try:
        return read_secret("ESC_API_KEY", os.environ)
    except SecretFileError as error:
        raise typer.BadParameter(str(error)) from None


def check_id(venue_id: str | None) -> str | None:
    """Refuse what is no id of a venue or a camera."""
    if venue_id is not None and not re.fullmatch(ID_PATTERN, venue_id):
        raise typer.BadParameter(f"{venue_id!r} is no id: {ID_IN_WORDS}, such as esc venue list prints")
    return venue_id


def check_job_id(job_id: str | None) -> str | None:
    """Refuse what is no id of a job."""
    if job_id is not None and not re.fullmatch(JOB_ID_PATTERN, job_id):
        raise typer.BadParameter(f"{job_id!r} is no id: 26 capital letters and digits, such as esc job list prints")
    return job_id


def require_folder_of(file: Path) -> Path:
    """Refuse a file to write whose folder is missing, before anything is computed for it."""
    if not file.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {file.parent}: make it first")
    return file


def existing_file(metavar: str, help: str) -> Any:
    """Return the argument of a file that is read."""
    return typer.Argument(metavar=metavar, exists=True, dir_okay=False, help=help)


def output_file(help: str) -> Any:
    """Return the option of a file that is written in the end."""
    return typer.Option("-o", "--output", callback=require_folder_of, help=help)


Sport = Annotated[str | None, typer.Option("--sport", help="Sport of the field: football, tennis ...")]
FieldSize = Annotated[
    str | None,
    typer.Option(
        "--field", metavar="LENGTHxWIDTH", help="Size of the field in metres; default: the sport's usual size."
    ),
]
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
    str, typer.Argument(metavar="VENUE", callback=check_id, help="Id of a venue, as `esc venue list` prints it.")
]
JobId = Annotated[
    str, typer.Argument(metavar="JOB", callback=check_job_id, help="Id of a job, as `esc job list` prints it.")
]
Frames = Annotated[
    list[str],
    typer.Argument(
        metavar="CAMERA=FILE...",
        help="A JPEG or PNG of each camera, such as left=left.jpg; several of one camera are fused.",
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
        help="stored: the poses in use, with the venue's lenses; "
        "refined: poses and lenses that fit the lines best, to measure in the world.",
    ),
]
OneCamera = Annotated[str | None, typer.Option("--camera", metavar="CAMERA", help="Id of one camera; default: all.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="File to write; otherwise standard output.")]
VenueOutput = Annotated[Path, output_file("JSON file to write the venue to, for `esc venue put` and `esc run`.")]
Seed = Annotated[
    int, typer.Option("--seed", min=0, help="Seed of the random numbers; the same seed gives the same result.")
]
Wait = Annotated[bool, typer.Option("--wait", help="Follow the job to its end and print it.")]
VenueOrFile = Annotated[
    str, typer.Argument(metavar="VENUE", help="Id of a venue of the service, or the JSON file of one.")
]
ProjectionOption = Annotated[
    Projection | None, typer.Option("--projection", help="How the picture is spread out; birds-eye: from above.")
]
Height = Annotated[str | None, typer.Option("--height", help="In pixels, even, or auto.")]
FieldOfView = Annotated[str | None, typer.Option("--field-of-view", help="In degrees, or auto.")]
Horizon = Annotated[str | None, typer.Option("--horizon", help="0: at the top, 1: at the bottom, or auto.")]
FollowEvery = Annotated[
    int, typer.Option("--follow-every", min=1, max=25, metavar="N", help="Measure in every Nth picture only.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON in place of lines.")]
AnswerAsJson = Annotated[
    bool, typer.Option("--json", help="Print JSON at a terminal too; what goes to a file or a pipe is JSON anyway.")
]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask for confirmation; required without a terminal.")]
IdempotencyKey = Annotated[
    str | None,
    typer.Option(
        "--idempotency-key",
        metavar="KEY",
        help="Idempotency key, any word: two requests with the same key are one job.",
    ),
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
    """Exit unless the user confirms what cannot be undone: by --yes, or at the terminal."""
    if yes:
        return
    if not sys.stdin.isatty():
        fail(f"Nothing was deleted. {question}? There is no terminal to ask at: confirm with --yes.", USAGE)
    if not typer.confirm(f"{question}? It cannot be undone", err=True):
        fail("Nothing was deleted.", FAILED)


def parse_frame_files(frames: Sequence[str]) -> dict[str, list[Path]]:
    """Return the files of each camera, from arguments CAMERA=FILE."""
    files: dict[str, list[Path]] = {}
    for frame in frames:
        camera, equals, name = frame.partition("=")
        if not (camera and equals and name):
            fail(f"{frame!r} is not CAMERA=FILE, for instance left=left.jpg", USAGE)
        if not Path(name).is_file():
            fail(f"There is no file {name} (camera {camera})", USAGE)
        files.setdefault(camera, []).append(Path(name))
    return files


def parse_options(text: str) -> Options:
    """Return the options of a calibration from the JSON of --options."""
    return parse_document(Options, text, "--options")


def parse_document(model: type[M], document: str | bytes, source: str, example: str = "") -> M:
    """Return a model from its JSON, or exit with a line for each error.

    `source`: the file or option that the lines name; `example`: a document of the expected form, printed below them.
    """
    try:
        return model.model_validate_json(document)
    except ValidationError as error:
        found = error.errors()
        is_json = all(finding["type"] != "json_invalid" for finding in found)
        messages = describe_errors(found, model, json.loads(document) if is_json else None)
        lines = [f"{source}: {message}" for message in messages]
        fail("\n".join([*lines, f"Expected is {example}"] if example else lines), USAGE)


def parse_field(sport: str, size: str | None) -> FieldOfPlay:
    """Return the field of a sport, of its usual size unless one is given (LENGTHxWIDTH, m)."""
    field: dict[str, Any] = {"template": sport}
    if size is not None:
        form = "LENGTHxWIDTH in metres, for instance 105x68"
        length, width = parse_parts(size, r"(\d+(?:\.\d+)?)[x×](\d+(?:\.\d+)?)", "--field", form)
        field |= {"length_m": float(length), "width_m": float(width)}
    return parse_document(FieldOfPlay, json.dumps(field), "--sport")


def parse_parts(text: str, pattern: str, option: str, form: str) -> tuple[str, ...]:
    """Return the parts of the value of an option, by the groups of a pattern; `form`: the expected form, in words."""
    match = re.fullmatch(pattern, text)
    if match is None:
        fail(f"{option} {text}: expected {form}", USAGE)
    return match.groups()


def require_cameras(venue: Venue, named: Iterable[str]) -> None:
    """Exit unless the venue has every camera in `named`."""
    known = [camera.id for camera in venue.cameras]
    if unknown := [camera for camera in dict.fromkeys(named) if camera not in known]:
        fail(f"The venue has no camera {', '.join(unknown)}; it has {', '.join(known)}", USAGE)


def parse_by_camera(arguments: Sequence[str], form: str) -> dict[str, str]:
    """Return the value of each camera, from arguments CAMERA=VALUE; `form`: the expected form, in words."""
    found: dict[str, str] = {}
    for argument in arguments:
        camera, equals, value = argument.partition("=")
        if not (camera and equals and value):
            fail(f"{argument!r} is not {form}", USAGE)
        if camera in found:
            fail(f"camera {camera} is given twice", USAGE)
        found[camera] = value
    return found


def parse_frame_rate(text: str, unit: str) -> Fraction:
    """Return the rate that --rate gives, a number or a fraction; `unit`: what it counts a second."""
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not 0 < rate <= HIGHEST_RATE:
        fail(f"--rate {text}: {unit} a second, such as 25, 29.97 or 30000/1001", USAGE)
    return rate
