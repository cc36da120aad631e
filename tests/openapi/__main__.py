"""`python -m tests.openapi`, a part of `make check`: additions only since the last release.

`--write VERSION` keeps the document of today as that of a release that is being made.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from tests.openapi.comparing import findings
from tools.openapi import document

HERE = Path(__file__).parent
# Words for people, which may be put better at any time.
WORDS = ("description", "summary", "title", "examples", "example")


def main() -> int:
    chosen = argparse.ArgumentParser(description=__doc__)
    chosen.add_argument("--write", metavar="VERSION")
    version = chosen.parse_args().write
    now = document()
    if version:
        kept = json.dumps(without_words(now), indent=1, sort_keys=True)
        (HERE / f"{version}.json").write_text(f"{kept}\n")
        return 0
    last = last_document()
    found = findings(json.loads(last.read_text()), now)
    for finding in found:
        print(finding, file=sys.stderr)
    print(f"{len(found)} removals or tightenings since {last.stem}, see docs/compatibility.md")
    return bool(found)


def last_document() -> Path:
    """Return the file with the OpenAPI document of the last release."""
    return max(HERE.glob("*.json"), key=lambda file: [int(number) for number in file.stem.split(".")])


def without_words(value: Any, *, names: bool = False) -> Any:
    """The same without what is said to people. `names`: the members are fields, which may be called so too."""
    if isinstance(value, list):
        return [without_words(one) for one in value]
    if not isinstance(value, dict):
        return value
    kept = value if names else {name: one for name, one in value.items() if name not in WORDS}
    return {
        name: without_words(one, names=name in ("properties", "schemas") and not names) for name, one in kept.items()
    }


if __name__ == "__main__":
    sys.exit(main())
