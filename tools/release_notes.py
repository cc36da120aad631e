"""Print what CHANGELOG.md says of a release, for its page; end with 1 where tag, sources and repository disagree.

python -m tools.release_notes v0.3.0 https://github.com/owner/esc
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

from tools.links import with_absolute_links

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Check and print."""
    tag, repository = sys.argv[1:]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    version = project["version"]
    if tag != f"v{version}":
        raise SystemExit(f"the tag is {tag}, but version in pyproject.toml is {version}: v{version} was expected")
    if project["urls"]["Repository"] != repository:
        raise SystemExit(
            f"[project.urls] in pyproject.toml names another repository than this one, {repository}: set it"
        )
    if not (ROOT / "tests" / "openapi" / f"{version}.json").is_file():
        raise SystemExit(f"tests/openapi/{version}.json is missing: python -m tests.openapi --write {version}")
    print(with_absolute_links(notes((ROOT / "CHANGELOG.md").read_text(), version), "", repository, tag))


def notes(changelog: str, version: str) -> str:
    """Return what stands below the heading of a version, which has a date behind it."""
    heading = rf"^## {re.escape(version)} \(\d{{4}}-\d\d-\d\d\)\n"
    found = re.search(rf"{heading}(.*?)(?=^## |\Z)", changelog, re.MULTILINE | re.DOTALL)
    if found is None:
        raise SystemExit(f"CHANGELOG.md has no heading `## {version} (date)`")
    return found[1].strip()


if __name__ == "__main__":
    main()
