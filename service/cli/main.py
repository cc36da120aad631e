"""`esc`: the command line, and the one place that puts the parts together.

What a command needs is imported where it runs: the client's commands start in a third of the time without the server.
"""

from __future__ import annotations

from typing import Annotated

import typer

from service import lifeline
from service.cli import calibrate, first, jobs, keys, serve, stitch, venues
from service.cli.printing import FAILED, fail

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
for command in (
    serve.up,
    serve.serve,
    serve.worker,
    calibrate.calibrate,
    calibrate.snapshot,
    calibrate.run,
    first.intrinsics,
    first.pose,
    stitch.stitch,
):
    app.command()(command)
app.add_typer(venues.app, name="venue")
app.add_typer(first.field_app, name="field")
app.add_typer(jobs.app, name="job")
app.add_typer(keys.app, name="key")


def main() -> None:
    """Run a command; what goes wrong is a line and an exit code, not a traceback."""
    lifeline.end_with_parent()
    try:
        app()
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError, FileExistsError) as error:
        fail(f"{error.filename}: {error.strerror}", FAILED)


def _say_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"esc {version('esc-calibration')}")
        raise typer.Exit


@app.callback()
def esc(
    _: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Keeps fixed multi-camera installations on sports fields calibrated."""
