"""What commands load: somebody, or cron, waits for each of them to begin."""

import ast
import os
import subprocess
import sys

from typer.main import get_command

from service.cli.main import app_of

LOADED = """
import atexit, sys
atexit.register(lambda: print([name for name, module in sys.modules.items() if module], file=sys.stderr))
from service.cli.main import main
sys.argv = ["esc", *sys.argv[1:]]
main()
"""


def loaded(*arguments, **environment):
    """What a command has loaded at its end: packages and modules by their names."""
    command = [sys.executable, "-c", LOADED, *arguments]
    ended = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    return set(ast.literal_eval(ended.stderr.splitlines()[-1]))


def test_help_and_completion_load_neither_models_nor_what_travels():
    packages = loaded("--help")
    assert {"typer", "rich"} <= packages
    assert not packages & {"httpx", "pydantic"}
    assert list(get_command(app_of(["job", "list", "--help"])).commands) == ["job"]
    # To read its arguments typer takes pydantic, as soon as a command is named.
    asked = {"_ESC_COMPLETE": "complete_bash", "COMP_WORDS": "esc job wa", "COMP_CWORD": "2"}
    for packages in (loaded("job", "list", "--help"), loaded("job", "get", "none"), loaded(**asked)):
        assert "typer" in packages
        assert not packages & {"httpx", "httpcore", "sqlalchemy", "numpy"}
    models = (
        "import sys, service.cli.main; print([name for name in sys.modules if name.startswith('service.schemas.')])"
    )
    told = subprocess.run([sys.executable, "-c", models], capture_output=True, text=True, check=True)
    assert told.stdout == "['service.schemas.names']\n"


def test_a_command_that_asks_for_venues_loads_neither_results_nor_another_command_line(service):
    modules = loaded("venue", "list", "--url", service.url)
    assert {"httpx", "service.client", "service.schemas.venue"} <= modules
    assert not modules & {"asyncio", "httpx._main", "rich", "click", "service.schemas.job", "service.schemas.results"}


def test_commands_of_the_client_load_neither_the_server_nor_the_engine():
    heavy = "fastapi sqlalchemy dbos structlog pydantic_settings croniter cv2 numpy"
    loaded = f"import sys, service.cli.main; print([name for name in {heavy.split()} if name in sys.modules])"
    told = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert told.stdout == "[]\n"
