"""The wheel: all that runs is in it."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("fields", "models", "service", "worker")
# What makes the network, and what is written about it.
COMMIT = "service/commit.txt"
STAYS = ("models/training", "models/README.md")


def built(tmp_path, source, **environment):
    """The names in the wheel of a source, and the commit that it carries."""
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--wheel-dir", tmp_path, source], check=True, env=os.environ | environment)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        shipped = {name for name in archive.namelist() if ".dist-info/" not in name}
        return shipped, archive.read(COMMIT).decode().strip() if COMMIT in shipped else None


@pytest.mark.long
def test_a_wheel_says_the_commit_of_the_clone_it_was_built_in(tmp_path):
    source = copied(tmp_path / "source")
    git = ["git", "-C", source, "-c", "user.name=n", "-c", "user.email=e"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "all"]):
        subprocess.run([*git, *command], check=True)
    head = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
    assert built(tmp_path, source)[1] == head
    # What runs is told it without git.
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as archive:
        archive.extractall(tmp_path / "installed")
    asked = "from service import build; print(build.description())"
    alone = os.environ | {"PYTHONPATH": str(tmp_path / "installed"), "PYTHONSAFEPATH": "1", "PATH": ""}
    said = subprocess.run([sys.executable, "-c", asked], env=alone, cwd=tmp_path, capture_output=True, text=True)
    assert said.stdout == f"{version('esc-calibration')} (commit {head[:12]})\n"


@pytest.mark.long
def test_without_a_clone_the_environment_says_the_commit(tmp_path):
    assert built(tmp_path, copied(tmp_path / "source"), SOURCE_COMMIT="c0ffee")[1] == "c0ffee"


@pytest.mark.long
def test_the_documented_commands_install_the_extras_of_the_wheel(tmp_path):
    """All that they ask for is installed here: with no index at hand, pip finds what it would install."""
    built(tmp_path, copied(tmp_path / "source"))
    pages = [ROOT / "docker" / "README.md", *(ROOT / "docs").glob("*.md")]
    commands = {one for page in pages for one in re.findall(r"pip install '(\./[^']+\.whl\[\w+\])'", page.read_text())}
    assert {re.search(r"\[(\w+)\]", one)[1] for one in commands} == {"cbor", "exr", "tracing", "video", "mqtt", "mcp"}
    for one in commands:
        pip = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-index", one]
        said = subprocess.run(pip, cwd=tmp_path, capture_output=True, text=True)
        assert (said.returncode, said.stderr) == (0, ""), said.stdout


def copied(source):
    for package in PACKAGES:
        shutil.copytree(ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    return source


@pytest.mark.long
def test_the_wheel_has_every_file_that_runs_and_no_other(tmp_path):
    source = copied(tmp_path / "source")
    files = [path for package in PACKAGES for path in (source / package).rglob("*") if path.is_file()]
    names = {path.relative_to(source).as_posix() for path in files}
    shipped, commit = built(tmp_path, source)
    # A source that is no clone says only its version.
    assert commit is None
    runs = {name for name in names if not name.startswith(STAYS)}
    assert {"missing": runs - shipped, "too much": shipped - runs} == {"missing": set(), "too much": set()}
