"""`esc`: the command line, and the one place that puts the parts together.

What a command needs is imported where it runs: the client's commands start in a third of the time without the server.
"""

from __future__ import annotations

import httpx
import typer

from service import lifeline
from service.cli import calibrate, first, jobs, keys, serve, venues
from service.cli.printing import BUSY, FAILED, fail, hint, in_words
from service.client import Refused

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, add_completion=False)
for command in (
    serve.up,
    serve.serve,
    serve.worker,
    calibrate.calibrate,
    calibrate.snapshot,
    calibrate.run,
    first.intrinsics,
    first.pose,
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
    except Refused as refused:
        fail(in_words(str(refused), refused.members) + hint(refused.status), BUSY if refused.busy else FAILED)
    except httpx.TransportError as error:
        fail(f"The service cannot be reached: {error or type(error).__name__}", FAILED)


@app.callback()
def esc() -> None:
    """Keeps fixed multi-camera installations on sports fields calibrated."""
