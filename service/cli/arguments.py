"""What commands are given: options that many of them have, and how their values are read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from pydantic import BaseModel, ValidationError

from service.cli.printing import USAGE, fail
from service.observe import logs
from service.settings import Settings
from service.wire.base import FormatName
from service.wire.options import Options

M = TypeVar("M", bound=BaseModel)
LOCAL = "http://127.0.0.1:8000"


def _as_header(key: str | None) -> str | None:
    """A key read from a file brings its line end along; what else no header takes is told here, not by the socket."""
    if key is None:
        return None
    if not re.fullmatch(r"[\x21-\x7e]+", key.strip()):
        raise typer.BadParameter("a key is letters, digits and signs, without spaces")
    return key.strip()


Url = Annotated[str, typer.Option("--url", envvar="ESC_URL", help="The service.")]
ApiKey = Annotated[
    str | None,
    typer.Option("--api-key", envvar="ESC_API_KEY", callback=_as_header, help="Sent as bearer token.", metavar="KEY"),
]
Data = Annotated[Path | None, typer.Option("--data", help="Folder of the embedded home (ESC_DATA).")]
Host = Annotated[str | None, typer.Option("--host", help="Address to listen on (ESC_HOST).")]
Port = Annotated[int | None, typer.Option("--port", help="0 takes a free one (ESC_PORT).")]
Frames = Annotated[list[str], typer.Argument(metavar="CAMERA=FILE...", help="Repeat a camera to fuse its frames.")]
Form = Annotated[FormatName, typer.Option("--format", help="Whose.")]
OneCamera = Annotated[str | None, typer.Option("--camera", help="One camera; otherwise all.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="File; otherwise standard output.")]
OptionsText = Annotated[str, typer.Option("--options", metavar="JSON", help='For instance {"dry_run": true}.')]


def settings_of(**given: Any) -> Settings:
    """The settings, those given on the command line before all others."""
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
    return checked(Options, text, "--options")


def checked(model: type[M], text: str, source: str) -> M:
    """A model from its JSON; `source` says whose fault it is if it is none."""
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        lines = [f"{source}: {'.'.join(map(str, e['loc']))} {e['msg']}" for e in error.errors()]
        fail("\n".join(lines), USAGE)
