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
    """What was loaded after each of several commands in one process: packages and modules by their names."""
    command = [sys.executable, "-c", LOADED, repr(commands)]
    ended = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    return [set(ast.literal_eval(line)) for line in ended.stderr.splitlines() if line.startswith("['sys'")]


def test_commands_load_what_they_need_and_help_version_and_completion_no_command():
    completion = {"_ESC_COMPLETE": "complete_bash", "COMP_WORDS": "esc ve", "COMP_CWORD": "1"}
    (completed,) = loaded([], **completion)
    commands = (["--help"], ["--version"], ["venue", "list", "--url", "http://127.0.0.1:9"], ["stitch", "--help"])
    _, version, listed, _, computing = loaded(*commands, ["pose", "--help"])
    for modules in (completed, version):
        own = {name for name in modules if name.startswith("service.cli.")}
        assert own == {"service.cli.main", "service.cli.printing"}
        assert "httpx" not in modules
    # Those of the client neither the server nor the engine.
    assert {"httpx", "service.client"} <= listed
    assert not listed & (SERVER | ENGINE)
    # Those that compute the engine only once its environment is set.
    assert {"service.cli.stitch", "service.cli.onboarding"} <= computing
    assert not computing & ENGINE


def test_the_line_of_help_of_a_command_is_the_beginning_of_its_help():
    for name, (_, summary) in COMMANDS.items():
        assert " ".join(load_command(name).help.split()).startswith(summary), name
