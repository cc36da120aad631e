"""The last release: its code, built from git, and dumps of databases that its code made."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import zipfile
from contextlib import closing
from pathlib import Path
from typing import Any

import psycopg

from service import child_process
from testbed import warm
from testbed.homes import Home, Servers
from testbed.running import PROGRAM as OF_THIS_VERSION
from testbed.running import Service

ROOT = Path(__file__).parents[1]
PROGRAM = "testbed/program.py"
DUMPS = ROOT / "tests" / "released" / "dumps"


def release_commit() -> str | None:
    """Return the commit of the last release, or None outside a clone with the whole history.

    A release is the commit that writes its OpenAPI document.
    """
    if shutil.which("git") is None or _git("rev-parse", "--is-shallow-repository") != b"false\n":
        return None
    return _git("log", "-1", "--format=%H", "--", "tests/openapi/*.json").decode().strip() or None


class Release:
    """The wheel of a commit, unpacked into a folder; its code runs from there with the libraries of this version."""

    def __init__(self, folder: Path, commit: str) -> None:
        source, self.code = folder / "source", folder / "code"
        source.mkdir(parents=True)
        subprocess.run(["tar", "-x", "-C", source], input=_git("archive", "--format=tar", commit), check=True)
        pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
        subprocess.run([*pip, "--wheel-dir", folder, source], check=True)
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as files:
            files.extractall(self.code)
        # The release's own stub of the engine, whose messages its workers understand.
        self._program = shutil.copy(source / PROGRAM, folder)
        shutil.rmtree(source)

    @property
    def environment(self) -> dict[str, str]:
        """Environment in which `python -m service.cli` runs the code of the release."""
        return {
            "PYTHONPATH": str(self.code),
            # Without it, the working directory, which may hold newer code, would come first.
            "PYTHONSAFEPATH": "1",
            "ESC_JOB_PROGRAM": json.dumps([sys.executable, str(self._program)]),
        }


def load_dump(home: Home, folder: Path) -> dict[str, Any]:
    """Make the database of a folder as a release left it; return what the release answered about it."""
    folder.mkdir(parents=True, exist_ok=True)
    name = "postgresql" if isinstance(home, Servers) else "sqlite"
    sql = (DUMPS / f"{name}.sql").read_text()
    if isinstance(home, Servers):
        with psycopg.connect(home.database_url(folder), autocommit=True) as database:
            database.execute(sql)
    else:
        with closing(sqlite3.connect(folder / "esc.sqlite")) as database:
            database.executescript(sql)
    answers: dict[str, Any] = json.loads((DUMPS / f"{name}.json").read_text())
    return answers


def worker_beside(service: Service, name: str, **environment: str) -> subprocess.Popen:
    """Start a worker in the home of a service; it is of this version unless `environment` is that of a release."""
    own = {name: value for name, value in service.environment.items() if name.startswith(("ESC_", "AWS_"))}
    command = [sys.executable, "-m", "service.cli", "worker", "--name", name]
    given = (
        os.environ | own | {"ESC_JOB_PROGRAM": json.dumps(OF_THIS_VERSION)} | environment | child_process.for_child()
    )
    return warm.Popen(command, env=given, stderr=service.log)


def _git(*arguments: str) -> bytes:
    return subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, check=True).stdout
