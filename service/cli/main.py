"""`esc`: the command line, and the one place that puts the parts together.

The module of a command is imported when it runs: help is printed in a third of the time that the server takes to load.
"""

import os
import sys
from importlib import import_module
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command, get_group

from service import build, child_process
from service.cli.printing import FAILED, fail

# Each command: the function or the group of commands in its module, and the beginning of its help.
COMMANDS = {
    "up": ("serve:up", "Run the whole service on this machine: API, operator's page and one worker"),
    "serve": ("serve:serve", "Run the API and the operator's page alone"),
    "worker": ("worker:worker", "Run a worker alone"),
    "calibrate": ("calibrate:calibrate", "Submit frames to a service."),
    "snapshot": ("calibrate:snapshot", "Save what the cameras show now"),
    "plan": ("plan:plan", "Plan cameras before they are mounted."),
    "run": ("run:run", "Calibrate a venue's file by frames, without a service."),
    "intrinsics": ("onboarding:intrinsics", "Find the lens of a camera from photos of a chessboard."),
    "pose": ("onboarding:pose", "Find first poses of cameras from clicked points."),
    "find": ("find:find", "Find cameras from their frames and the field alone."),
    "check": ("check:check", "Check a calibration of any tool by frames."),
    "convert": ("convert:convert", "Convert a calibration to the format of another tool."),
    "stitch": ("stitch:stitch", "Stitch clips into one, on this machine."),
    "live": ("live:live", "Send the poses of a venue to renderers until stopped, by OpenTrackIO and FreeD over UDP."),
    "mqtt": ("mqtt:mqtt", "Publish venues to an MQTT broker until stopped: each is a device of Home Assistant."),
    "mcp": ("mcp:mcp", "Serve assistants by the Model Context Protocol: they read venues and propose calibrations."),
    "venue": ("venues:app", "Venues: pitch, cameras, stored poses."),
    "field": ("onboarding:field_app", "The pitch of a venue: fit its length, width and ridge."),
    "job": ("jobs:app", "Jobs of a running service: calibrations, and what comes before the first."),
    "key": ("keys:app", "API keys, in the database of this machine's service."),
    "home": ("home:app", "The home of a service: its database and its files."),
}


def main() -> None:
    """Run a command; a fault is a line and an exit code, not a traceback."""
    child_process.end_with_parent()
    # Pydantic would look for plugins among all installed packages, a quarter of the time of a short command.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    try:
        app(prog_name="esc")
    except BrokenPipeError:
        # Nobody reads any more, as after `| head -2`.
        pass
    except OSError as error:
        why = error.strerror or str(error)
        fail(f"{error.filename}: {why}" if error.filename else why, FAILED)
    finally:
        _flush_output()


def _flush_output() -> None:
    """Write what was printed, in silence where nobody reads it any more, as after `| head -2`.

    The interpreter, which does it otherwise, prints a traceback then and makes the exit code 120.
    """
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        # The rest of the output is discarded.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def load_command(name: str) -> TyperCommand | TyperGroup:
    """Import the module of a command of `COMMANDS` and return the command."""
    module, attribute = COMMANDS[name][0].split(":")
    target = getattr(import_module(f"service.cli.{module}"), attribute)
    if isinstance(target, typer.Typer):
        return get_group(target)
    alone = typer.Typer(add_completion=False)
    alone.command()(target)
    return cast(TyperCommand, get_command(alone))


class LazyCommands(TyperGroup):
    """The commands of `COMMANDS`: a line of help for each, until one is asked for, which is imported.

    Values are refused in the words of ESC, not in those of the library that checks them.
    """

    def __init__(self, **attributes: Any) -> None:
        lines = {name: TyperCommand(name, help=summary) for name, (_, summary) in COMMANDS.items()}
        super().__init__(**attributes | {"commands": lines})

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the name of the command that was asked for, the command, and its arguments."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, name and command and load_command(name), rest

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as refusal:
            if isinstance(refusal.__cause__, ValueError) and hasattr(refusal.__cause__, "errors"):
                # The schemas are loaded with the command by now.
                from service.schemas.findings import describe_errors

                found = [one | {"loc": ()} for one in refusal.__cause__.errors()]
                refusal.message = "; ".join(describe_errors(found, None, None))
            raise


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"esc {build.description()}")
        raise typer.Exit


app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, cls=LazyCommands)


@app.callback()
def esc(
    _: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Keeps fixed multi-camera installations on sports fields calibrated."""
