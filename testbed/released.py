"""Release 0.1.0: its code, built from git, and what its databases looked like."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from service import child_process
from testbed import warm
from testbed.running import PROGRAM as OF_THIS_VERSION
from testbed.running import Service

ROOT = Path(__file__).parents[1]
COMMIT = "cf3f845b1f70eef2ae4c56faafa5580c73535971"
PROGRAM = "tests/e2e/program.py"
DUMPS = ROOT / "tests" / "released" / "dumps"


def is_in_git() -> bool:
    """True if this is a clone that has the release in its history."""
    found = _git("cat-file", "-e", f"{COMMIT}^{{commit}}", check=False)
    return found is not None and found.returncode == 0


class Release:
    """The wheel of 0.1.0, unpacked into a folder: its code runs from there with the libraries of this one."""

    def __init__(self, folder: Path) -> None:
        source, self.code = folder / "source", folder / "code"
        source.mkdir(parents=True)
        archive = _git("archive", "--format=tar", COMMIT)
        subprocess.run(["tar", "-x", "-C", source], input=archive.stdout, check=True)
        pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
        subprocess.run([*pip, "--wheel-dir", folder, source], check=True)
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as files:
            files.extractall(self.code)
        # What stands in for its engine, which knows what its messages had in them.
        self._program = shutil.copy(source / PROGRAM, folder)
        shutil.rmtree(source)

    @property
    def environment(self) -> dict[str, str]:
        """With which `python -m service.cli` is this release's."""
        return {
            "PYTHONPATH": str(self.code),
            # The folder that a process is started in is not looked into, which may be that of a newer code.
            "PYTHONSAFEPATH": "1",
            "ESC_JOB_PROGRAM": json.dumps([sys.executable, str(self._program)]),
        }


def worker_beside(service: Service, name: str, **environment: str) -> subprocess.Popen:
    """A worker in the home of a service, of this version unless the environment is another one's."""
    own = {name: value for name, value in service.environment.items() if name.startswith(("ESC_", "AWS_"))}
    command = [sys.executable, "-m", "service.cli", "worker", "--name", name]
    given = (
        os.environ | own | {"ESC_JOB_PROGRAM": json.dumps(OF_THIS_VERSION)} | environment | child_process.for_child()
    )
    return warm.Popen(command, env=given, stderr=service.log)


def _git(*arguments: str, check: bool = True) -> subprocess.CompletedProcess | None:
    if shutil.which("git") is None:
        return None
    return subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, check=check)
