"""The wheel: all that runs is in it."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("fields", "models", "service", "worker")
# What makes the network, and what is written about it.
STAYS = ("models/training", "models/README.md")


def test_the_wheel_has_every_file_that_runs_and_no_other(tmp_path):
    source = tmp_path / "source"
    for package in PACKAGES:
        shutil.copytree(ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    files = [path for package in PACKAGES for path in (source / package).rglob("*") if path.is_file()]
    names = {path.relative_to(source).as_posix() for path in files}

    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--wheel-dir", tmp_path, source], check=True)

    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        shipped = {name for name in archive.namelist() if ".dist-info/" not in name}
    runs = {name for name in names if not name.startswith(STAYS)}
    assert {"missing": runs - shipped, "too much": shipped - runs} == {"missing": set(), "too much": set()}
