"""`esc`: in this process, or in one of its own."""

import io
import os
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from subprocess import PIPE, CompletedProcess
from unittest.mock import patch

from service.cli.main import COMMANDS, load_command, main
from service.observability import logs
from testbed import warm


def esc_here(folder: Path, *arguments: str, **environment: str) -> CompletedProcess:
    """Run a command in this process, and return what a process in this folder and environment would have printed.

    It spares each call the second in which a new interpreter imports everything. Not for what serves: that would go on
    holding its socket and its database.
    """
    out, err = io.TextIOWrapper(io.BytesIO()), io.StringIO()
    code = 0
    with (
        chdir(folder),
        patch.dict(os.environ, environment, clear=True),
        patch.object(sys, "argv", ["esc", *arguments]),
        # The logs of this process are those of the tests.
        patch.object(logs, "configure"),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    out.flush()
    return CompletedProcess(arguments, code, out.buffer.getvalue().decode(errors="replace"), err.getvalue())


def all_commands():
    """Yield every command and group of commands of `esc`, with the words that call it."""
    waiting = [(name, load_command(name)) for name in COMMANDS]
    for words, command in waiting:
        yield words, command
        waiting += [(f"{words} {name}", one) for name, one in getattr(command, "commands", {}).items()]


def esc_process(folder: Path, *arguments: str, stdin: int | None = None, **environment: str) -> CompletedProcess:
    """Run the command in a process of its own, with this beside the environment of the tests."""
    command = [sys.executable, "-m", "service.cli", *arguments]
    how = {"cwd": folder, "env": os.environ | environment, "stdin": stdin, "stdout": PIPE, "stderr": PIPE}
    with warm.Popen(command, text=True, **how) as process:
        try:
            out, err = process.communicate(timeout=60)
        except BaseException:
            process.kill()
            raise
    return CompletedProcess(command, process.returncode, out, err)
