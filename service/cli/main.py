"""`esc`: the command line, and the one place that puts the parts together.

What a command needs is imported where it runs: the client's commands start in a third of the time without the server.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from service import child_process
from service.cli import calibrate, find, home, jobs, keys, live, onboarding, serve, stitch, venues
from service.cli.printing import FAILED, fail

COMMANDS = (
    serve.up,
    serve.serve,
    serve.worker,
    calibrate.calibrate,
    calibrate.snapshot,
    calibrate.run,
    onboarding.intrinsics,
    onboarding.pose,
    find.find,
    stitch.stitch,
    live.live,
)
NOUNS = {"venue": venues.app, "field": onboarding.field_app, "job": jobs.app, "key": keys.app, "home": home.app}


def main() -> None:
    """Run a command; what goes wrong is a line and an exit code, not a traceback."""
    child_process.end_with_parent()
    try:
        app_of(sys.argv[1:])()
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
        # What is still to be written goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def app_of(arguments: Sequence[str]) -> typer.Typer:
    """The command line as far as these arguments ask for it: to describe all commands takes longer than to run one."""
    asked = arguments[0] if arguments else None
    commands = [command for command in COMMANDS if command.__name__ == asked]
    nouns = {name: noun for name, noun in NOUNS.items() if name == asked}
    if not commands and not nouns:
        commands, nouns = [*COMMANDS], NOUNS
    app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, cls=_Commands)
    app.callback()(esc)
    for command in commands:
        app.command()(command)
    for name, noun in nouns.items():
        app.add_typer(noun, name=name)
    return app


class _Commands(TyperGroup):
    """The commands, whose values are refused in the words of ours, not in those of what checks them."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as refusal:
            if isinstance(refusal.__cause__, ValueError) and hasattr(refusal.__cause__, "errors"):
                from service.schemas.findings import describe_errors

                found = [one | {"loc": ()} for one in refusal.__cause__.errors()]
                refusal.message = "; ".join(describe_errors(found, None, None))
            raise


def _print_version(asked: bool) -> None:
    if asked:
        from service import build

        print(f"esc {build.description()}")
        raise typer.Exit


def esc(
    _: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Keeps fixed multi-camera installations on sports fields calibrated."""
