"""Build `esc_client` from the sources of the service: the modules that its client reaches, under a name of their own.

There is one source. `esc_client/__init__.py` says what the package offers and is, like every module here, written
against the packages `service` and `fields`. The build follows its imports, also those inside functions and those for
type checkers only, copies each module that is reached, and replaces the package in each import: `service.client` is
`esc_client.client`, `fields.shapes` is `esc_client.fields.shapes`. All else in a module stays as it is.

What cannot be rewritten, and what would need a package that the client does not depend on, fails the build.
"""

import ast
import re
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.editable_wheel import editable_wheel

PACKAGE = "esc_client"
HERE = Path(__file__).resolve().parent
SOURCES = HERE.parent
# The packages of the sources, and what they are called in the client.
RENAMED = {"service": PACKAGE, "fields": f"{PACKAGE}.fields"}
# Read by the modules of a package.
DATA = {"fields": "*.toml"}
DEPENDENCIES = ("httpx", "pydantic")
# The schemas leave it to the service to judge a schedule or a lens where these are missing.
DISPENSABLE = {"croniter", "numpy"}


class Unfit(Exception):  # noqa: N818
    """A source cannot become part of the client; the message says where and why."""


class BuildFromSources(build_py):
    """Put the rewritten modules into the build folder, and nothing else."""

    def run(self) -> None:
        """Build; raises `Unfit`."""
        built = Path(self.build_lib) / PACKAGE
        # What an earlier build left would go into the wheel.
        shutil.rmtree(built, ignore_errors=True)
        modules = reached(HERE / PACKAGE / "__init__.py")
        for module, source in modules.items():
            write(built.parent / target(module, source), rewritten(source))
        for package, pattern in DATA.items():
            if package in modules:
                for file in sorted((SOURCES / package).glob(pattern)):
                    write(built.parent / renamed(package).replace(".", "/") / file.name, file.read_bytes())
        write(built / "__init__.py", rewritten(HERE / PACKAGE / "__init__.py"))
        write(built / "py.typed", b"")


class NoEditableInstallation(editable_wheel):
    """There is no folder with the modules as they are imported, which an editable installation would point to."""

    def run(self) -> None:
        """Raise `Unfit`."""
        raise Unfit(f"{PACKAGE} has no sources of its own and cannot be installed as editable; edit service/client.py")


def reached(root: Path) -> dict[str, Path]:
    """The modules of the sources that a file imports, directly or not, with the packages that they are in."""
    found: dict[str, Path] = {}
    wanted = list(imported(root))
    while wanted:
        module = wanted.pop()
        # The package `service` itself becomes `esc_client`, which has an `__init__.py` of its own.
        if module in found or module == "service":
            continue
        found[module] = source_of(module)
        wanted += imported(found[module])
        package = module.rpartition(".")[0]
        wanted += [package] if package else []
    return dict(sorted(found.items()))


def imported(source: Path) -> Iterator[str]:
    """The modules of the sources that a file imports; raises `Unfit` for what the client cannot import."""
    for node in ast.walk(ast.parse(source.read_bytes())):
        if isinstance(node, ast.ImportFrom):
            if node.level or node.module is None:
                raise unfit(source, node, "a relative import is not rewritten")
            if is_ours(node.module):
                yield node.module
                yield from (name for name in (f"{node.module}.{one.name}" for one in node.names) if is_module(name))
            else:
                expect_available(source, node, node.module)
        elif isinstance(node, ast.Import):
            for one in node.names:
                if is_ours(one.name):
                    raise unfit(source, node, f"`import {one.name}` is not rewritten; write `from ... import ...`")
                expect_available(source, node, one.name)
        elif isinstance(node, ast.Name | ast.Attribute) and name_of(node) in ("import_module", "__import__"):
            raise unfit(source, node, "an import by a name that is computed is not rewritten")


def expect_available(source: Path, node: ast.AST, module: str) -> None:
    """Raise `Unfit` for a module that neither Python nor the dependencies of the client bring along."""
    package = module.partition(".")[0]
    if package not in sys.stdlib_module_names and package not in DEPENDENCIES and package not in DISPENSABLE:
        raise unfit(source, node, f"{package} is no dependency of the client ({', '.join(DEPENDENCIES)})")


def rewritten(source: Path) -> bytes:
    """The text of a module with the packages of its imports renamed."""
    lines = source.read_bytes().splitlines(keepends=True)
    for node in ast.walk(ast.parse(b"".join(lines))):
        if isinstance(node, ast.ImportFrom) and node.module is not None and is_ours(node.module):
            line = lines[node.lineno - 1]
            statement, before = line[node.col_offset :], f"from {node.module} ".encode()
            if not statement.startswith(before):
                raise unfit(source, node, "an import in an unusual form is not rewritten")
            after = f"from {renamed(node.module)} ".encode()
            lines[node.lineno - 1] = line[: node.col_offset] + after + statement.removeprefix(before)
    return b"".join(lines)


def target(module: str, source: Path) -> str:
    """The path of a module of the sources in the client."""
    path = renamed(module).replace(".", "/")
    return f"{path}/__init__.py" if source.name == "__init__.py" else f"{path}.py"


def renamed(module: str) -> str:
    """What a module of the sources is called in the client."""
    package, dot, rest = module.partition(".")
    return f"{RENAMED[package]}{dot}{rest}"


def is_ours(module: str) -> bool:
    """Whether a module is one of the sources."""
    return module.partition(".")[0] in RENAMED


def is_module(name: str) -> bool:
    """Whether there is a module of this name in the sources, and not something in a module."""
    path = SOURCES / name.replace(".", "/")
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def source_of(module: str) -> Path:
    """The file of a module of the sources."""
    path = SOURCES / module.replace(".", "/")
    package = path / "__init__.py"
    return package if package.is_file() else path.with_suffix(".py")


def name_of(node: ast.Name | ast.Attribute) -> str:
    """The last part of a name as it is written."""
    return node.id if isinstance(node, ast.Name) else node.attr


def unfit(source: Path, node: ast.AST, why: str) -> Unfit:
    """Say what is wrong with a statement of a source."""
    return Unfit(f"{source.relative_to(SOURCES)}, line {getattr(node, 'lineno', 0)}: {why}")


def write(file: Path, content: bytes) -> None:
    """Write a file, and make its folder."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content)


def of_the_service() -> dict[str, Any]:
    """The version of the service, and what it demands of the packages that its client needs as well."""
    project = SOURCES / "pyproject.toml"
    if not project.is_file():
        raise Unfit(f"{PACKAGE} is built inside a source of ESC: `make wheel` there")
    service = tomllib.loads(project.read_text())["project"]
    demanded = {re.split(r"[^\w-]", one, maxsplit=1)[0]: one for one in service["dependencies"]}
    return {"version": service["version"], "install_requires": [demanded[name] for name in DEPENDENCIES]}


setup(cmdclass={"build_py": BuildFromSources, "editable_wheel": NoEditableInstallation}, **of_the_service())
