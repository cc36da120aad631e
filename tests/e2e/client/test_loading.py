"""What commands load: somebody, or cron, waits for each of them to begin."""

import ast
import os
import subprocess
import sys

import pytest

from service.cli.main import COMMANDS, load_command

LOADED = """
import atexit, sys
atexit.register(lambda: print([*sys.modules], file=sys.stderr))
from service.cli.main import main
sys.argv = ["esc", *sys.argv[1:]]
main()
"""
SERVER = {"fastapi", "sqlalchemy", "dbos", "structlog", "pydantic_settings"}
ENGINE = {"croniter", "cv2", "numpy"}


def loaded(*arguments, **environment):
    """What a command has loaded at its end: packages and modules by their names."""
    command = [sys.executable, "-c", LOADED, *arguments]
    ended = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    return set(ast.literal_eval(ended.stderr.splitlines()[-1]))


@pytest.mark.parametrize(
    ("arguments", "environment"),
    [
        (["--help"], {}),
        (["--version"], {}),
        ([], {"_ESC_COMPLETE": "complete_bash", "COMP_WORDS": "esc ve", "COMP_CWORD": "1"}),
    ],
)
def test_help_version_and_completion_load_no_command(arguments, environment):
    modules = loaded(*arguments, **environment)
    assert {name for name in modules if name.startswith("service.cli.")} == {"service.cli.main", "service.cli.printing"}
    assert "httpx" not in modules


def test_commands_of_the_client_load_neither_the_server_nor_the_engine():
    modules = loaded("venue", "list", "--url", "http://127.0.0.1:9")
    assert {"httpx", "service.client"} <= modules
    assert not modules & (SERVER | ENGINE)


def test_commands_that_compute_load_the_engine_after_its_environment_is_set():
    assert not loaded("stitch", "--help") & ENGINE
    assert not loaded("pose", "--help") & ENGINE


def test_the_line_of_help_of_a_command_is_the_beginning_of_its_help():
    for name, (_, summary) in COMMANDS.items():
        assert " ".join(load_command(name).help.split()).startswith(summary), name
