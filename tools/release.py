"""Build the wheels and source distributions of a release, and prove them before anybody uploads them.

    python -m tools.release [DIST]

What is committed is built twice, in two folders: source distributions, and wheels from these. Every byte has to be the
same. Then the metadata is checked as PyPI does, the wheels are installed into an empty environment beside the pinned
packages, and the demo venue is calibrated there. DIST (default: dist) gets the files and the bill of materials.
Nothing is uploaded.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import venv
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from tools.links import with_absolute_links

ROOT = Path(__file__).parents[1]
BILL_OF_MATERIALS = "sbom.cdx.json"
PROBE = """
import esc_client
from importlib.metadata import files
print("esc_client", esc_client.__version__)
print(next(file for file in files("esc-calibration") if "sboms" in file.parts))
"""


def main() -> None:
    """Build, compare, check, install, try."""
    dist = Path(sys.argv[1] if len(sys.argv) > 1 else "dist").resolve()
    os.umask(0o022)
    with tempfile.TemporaryDirectory(prefix="esc-release-") as folder:
        work = Path(folder)
        tree = export_tree(work / "first")
        built = build(tree, work / "dist-first", "UTC")
        again = build(export_tree(work / "second-elsewhere"), work / "dist-second", "Asia/Tokyo")
        for one, other in zip(built, again, strict=True):
            compare(one, other)
        run(sys.executable, "-m", "twine", "check", "--strict", *built)
        try_wheels(tree, [path for path in built if path.suffix == ".whl"], work / "installed")
        dist.mkdir(parents=True, exist_ok=True)
        for path in [*built, tree / BILL_OF_MATERIALS]:
            shutil.copy(path, dist)
            print(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {dist / path.name}")


def export_tree(folder: Path) -> Path:
    """Return a folder with what is committed, and with what only a release has."""
    print(f"Building {commit()}")
    with tarfile.open(fileobj=io.BytesIO(git("archive", commit()))) as archive:
        archive.extractall(folder, filter="data")
    (folder / "service" / "commit.txt").write_text(f"{commit()}\n")
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    repository, tag = project["urls"]["Repository"], f"v{project['version']}"
    for readme in (folder / "README.md", folder / "client" / "README.md"):
        at = readme.parent.relative_to(folder).as_posix()
        readme.write_text(with_absolute_links(readme.read_text(), at, repository, tag))
    # It warns that a lock does not say what depends on what.
    listed = (sys.executable, "-W", "ignore", "-m", "cyclonedx_py", "requirements", "docker/requirements.lock")
    run(*listed, "--pyproject", "pyproject.toml", "--output-reproducible", "-o", BILL_OF_MATERIALS, folder=folder)
    return folder


def build(tree: Path, dist: Path, time_zone: str) -> list[Path]:
    """Return wheels and source distributions of service and client, in alphabetical order."""
    for source in (tree, tree / "client"):
        command = (sys.executable, "-m", "build", "--no-isolation", "--outdir", dist, source)
        run(*command, env=os.environ | stamp() | {"TZ": time_zone}, stdout=subprocess.DEVNULL)
    for archive in dist.glob("*.tar.gz"):
        normalise(archive)
    return sorted(dist.iterdir())


def stamp() -> dict[str, str]:
    """Return the time of the commit, as tools that build reproducibly look for it."""
    return {"SOURCE_DATE_EPOCH": git("log", "-1", "--format=%ct", commit()).decode().strip()}


def normalise(path: Path) -> None:
    """Pack a source distribution anew: setuptools leaves the time and the user of the build in it."""
    time = int(stamp()["SOURCE_DATE_EPOCH"])
    packed = io.BytesIO()
    with tarfile.open(path) as before, tarfile.open(fileobj=packed, mode="w") as after:
        for member in sorted(before.getmembers(), key=lambda member: member.name):
            member.mtime, member.uid, member.gid, member.uname, member.gname = time, 0, 0, "", ""
            member.pax_headers = {}
            after.addfile(member, before.extractfile(member) if member.isfile() else None)
    path.write_bytes(gzip.compress(packed.getvalue(), mtime=time))


def compare(one: Path, other: Path) -> None:
    """End with the name of the first member that differs between two builds of a file, if any does."""
    if one.name == other.name and one.read_bytes() == other.read_bytes():
        return
    pairs = zip(members(one), members(other), strict=False)
    which = next(
        (f"{first[0]} and {second[0]}" for first, second in pairs if first != second), "their number of members"
    )
    raise SystemExit(f"{one.name} is not reproducible: two builds of one commit differ in {which}")


def members(path: Path) -> Iterator[tuple[str, object, bytes]]:
    """Yield name, mode and time, and content of what an archive has, in its order."""
    if path.suffix == ".whl":
        with zipfile.ZipFile(path) as wheel:
            yield from ((one.filename, (one.external_attr, one.date_time), wheel.read(one)) for one in wheel.infolist())
    else:
        with tarfile.open(path) as archive:
            for one in archive:
                file = archive.extractfile(one)
                yield one.name, (one.mode, one.mtime, one.uid), file.read() if file else b""


def try_wheels(tree: Path, wheels: list[Path], folder: Path) -> None:
    """Install the wheels where nothing else of ESC is, and calibrate the demo venue there."""
    venv.create(folder, with_pip=True)
    install = (folder / "bin" / "pip", "install", "--quiet", "--disable-pip-version-check")
    run(*install, "--require-hashes", "--only-binary=:all:", "-r", tree / "docker" / "requirements.lock")
    run(*install, "--no-index", "--no-deps", *wheels)
    run(folder / "bin" / "pip", "check")
    esc = folder / "bin" / "esc"
    run(esc, "--help", folder=folder, stdout=subprocess.DEVNULL)
    run(esc, "--version", folder=folder)
    run(folder / "bin" / "python", "-c", PROBE, folder=folder)
    demo = tree / "demo"
    frames = [f"{camera}={demo / camera}.jpg" for camera in ("left", "right")]
    # It ends with 0 only if the poses were accepted.
    run(esc, "run", demo / "venue.json", *frames, "-o", folder / "result", folder=folder, stdout=subprocess.DEVNULL)
    print("The wheels are installed, and the demo venue is calibrated.")


def run(*command: str | Path, folder: Path = ROOT, **options: Any) -> None:
    """Run a command at the time of the commit; end if it fails. `options` as `subprocess.run` takes them."""
    ended = subprocess.run(command, cwd=folder, check=False, **{"env": os.environ | stamp()} | options)
    if ended.returncode:
        raise SystemExit(f"failed with {ended.returncode}: {' '.join(map(str, command))}")


@cache
def commit() -> str:
    """Return the commit that is released, though others may be made meanwhile."""
    return git("rev-parse", "HEAD").decode().strip()


def git(*words: str) -> bytes:
    """Return what git says of this clone."""
    return subprocess.run(["git", "-C", ROOT, *words], check=True, stdout=subprocess.PIPE).stdout


if __name__ == "__main__":
    main()
