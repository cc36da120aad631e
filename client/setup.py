"""Build `esc_client` from the sources of the service: the modules that its client reaches, under a name of their own.

There is one source. `esc_client/__init__.py` says what the package offers and is, like every module here, written
against the packages `service` and `fields`. The build copies each module that it imports, directly or not, and renames
the package in each import: `service.client` is `esc_client.client`, `fields.shapes` is `esc_client.fields.shapes`.
A source distribution has the copies, so that it needs neither a clone nor this file.
The tests import every module of the wheel where nothing else of ESC is installed.
"""

import ast
import json
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.editable_wheel import editable_wheel
from setuptools.command.sdist import sdist

PACKAGE = "esc_client"
HERE = Path(__file__).resolve().parent
SOURCES = HERE.parent
# The folders of the sources, and what they are called in the client.
RENAMED = {"service": PACKAGE, "fields": f"{PACKAGE}/fields", f"client/{PACKAGE}": PACKAGE}
OUR_IMPORT = re.compile(rb"^(\s*from )(service|fields)(?=[. ])", re.MULTILINE)
DEPENDENCIES = ("httpx", "pydantic")


class BuildFromSources(build_py):
    """Put the copied modules into the build folder, and nothing else."""

    def run(self) -> None:
        """Build."""
        # Files of an earlier build would go into the wheel.
        shutil.rmtree(Path(self.build_lib) / PACKAGE, ignore_errors=True)
        copy_modules(Path(self.build_lib))


class SourcesWithoutClone(sdist):
    """Put the copied modules into the source distribution, and a pyproject.toml that says all by itself."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Fill the folder that is packed."""
        super().make_release_tree(base_dir, files)
        tree = Path(base_dir)
        copy_modules(tree)
        (tree / "setup.py").unlink()
        metadata = project_metadata()
        values = {"version": metadata["version"], "dependencies": metadata["install_requires"]}
        static = "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items())
        static += "".join(f"urls.{name} = {json.dumps(url)}\n" for name, url in metadata["project_urls"].items())
        project = tree / "pyproject.toml"
        project.write_text(re.sub(r"^dynamic = .*\n", lambda _: static, project.read_text(), flags=re.MULTILINE))


class NoEditableInstallation(editable_wheel):
    """Refuse an editable installation: there is no folder with the modules as they are imported."""

    def run(self) -> None:
        """Raise an error."""
        raise SystemExit(f"{PACKAGE} has no sources of its own, so it cannot be editable; edit service/client.py")


def copy_modules(target: Path) -> None:
    """Write the package into the folder `target`, with its imports renamed."""
    for source in [*reached_modules(HERE / PACKAGE / "__init__.py"), *(SOURCES / "fields").glob("*.toml")]:
        folder = source.parent.relative_to(SOURCES).as_posix()
        before = next(name for name in RENAMED if folder.startswith(name))
        copy = target / folder.replace(before, RENAMED[before], 1) / source.name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(OUR_IMPORT.sub(renamed_import, source.read_bytes()))
    (target / PACKAGE / "py.typed").touch()


def reached_modules(root: Path) -> set[Path]:
    """Return the file `root`, those that it imports of the sources, directly or not, and those of their packages."""
    found: set[Path] = set()
    waiting = {root}
    while waiting:
        found |= waiting
        trees = [ast.parse(source.read_bytes()) for source in waiting]
        imports = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        names = {f"{node.module}.{name.name}" for node in imports for name in node.names}
        waiting = {source for name in names for source in module_files(name)} - found
    return found


def module_files(name: str) -> list[Path]:
    """Return the files of the sources that an import of something by its full name loads."""
    package, *parts = name.split(".")
    if package not in ("service", "fields"):
        return []
    paths = [SOURCES.joinpath(package, *parts[:count]) for count in range(len(parts) + 1)]
    files = [file for path in paths for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()]
    # The package `service` itself becomes `esc_client`, which has an `__init__.py` of its own.
    return [file for file in files if file != SOURCES / "service" / "__init__.py"]


def renamed_import(match: re.Match[bytes]) -> bytes:
    """Return the beginning of an import with the package renamed."""
    return match[1] + RENAMED[match[2].decode()].replace("/", ".").encode()


def project_metadata() -> dict[str, Any]:
    """Return version and addresses of the service, and its demands on the packages that its client needs as well."""
    project = SOURCES / "pyproject.toml"
    if not project.is_file():
        raise SystemExit(f"{PACKAGE} is built inside a source of ESC: `make wheel` there")
    service = tomllib.loads(project.read_text())["project"]
    demands = {re.split(r"[^\w-]", demand, maxsplit=1)[0]: demand for demand in service["dependencies"]}
    needed = [demands[name] for name in DEPENDENCIES]
    return {"version": service["version"], "install_requires": needed, "project_urls": service["urls"]}


COMMANDS = {"build_py": BuildFromSources, "editable_wheel": NoEditableInstallation, "sdist": SourcesWithoutClone}
setup(cmdclass=COMMANDS, **project_metadata())
