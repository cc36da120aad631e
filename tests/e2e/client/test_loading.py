"""What commands load: somebody, or cron, waits for each of them to begin."""

import ast
import os
import subprocess
import sys

from service.cli.main import COMMANDS, load_command

LOADED = """
import ast, sys
from contextlib import suppress
from service.cli.main import main
for words in ast.literal_eval(sys.argv[1]):
    sys.argv = ["esc", *words]
    with suppress(SystemExit):
        main()
print([*sys.modules], file=sys.stderr)
"""
SERVER = {"fastapi", "sqlalchemy", "dbos", "structlog", "pydantic_settings"}
ENGINE = {"croniter", "cv2", "numpy"}


def loaded(*commands, **environment):
    """What commands have loaded in one process: packages and modules by their names."""
    command = [sys.executable, "-c", LOADED, repr(commands)]
    ended = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    return set(ast.literal_eval(ended.stderr.splitlines()[-1]))


def test_help_version_and_completion_load_no_command():
    completion = {"_ESC_COMPLETE": "complete_bash", "COMP_WORDS": "esc ve", "COMP_CWORD": "1"}
    modules = loaded(["--help"], ["--version"]) | loaded([], **completion)
    assert {name for name in modules if name.startswith("service.cli.")} == {"service.cli.main", "service.cli.printing"}
    assert "httpx" not in modules


def test_commands_of_the_client_load_neither_the_server_nor_the_engine():
    modules = loaded(["venue", "list", "--url", "http://127.0.0.1:9"])
    assert {"httpx", "service.client"} <= modules
    assert not modules & (SERVER | ENGINE)


def test_commands_that_compute_load_the_engine_after_its_environment_is_set():
    modules = loaded(["stitch", "--help"], ["pose", "--help"])
    assert {"service.cli.stitch", "service.cli.onboarding"} <= modules
    assert not modules & ENGINE


def test_the_line_of_help_of_a_command_is_the_beginning_of_its_help():
    for name, (_, summary) in COMMANDS.items():
        assert " ".join(load_command(name).help.split()).startswith(summary), name
