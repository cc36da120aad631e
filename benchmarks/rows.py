"""Results of runs, a line of JSON for each, so that long benchmarks can be continued."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path


class Rows:
    """The rows of a file, by their keys."""

    def __init__(self, path: Path) -> None:
        self.path = path
        written = path.read_text().splitlines() if path.exists() else []
        self.known = {_name(row["key"]): row for row in map(json.loads, written)}

    def remembered(self, key: dict, run: Callable[..., dict], *arguments: object) -> dict:
        """Return the row of a key, from the file or run now with the arguments and appended to it."""
        name = _name(key)
        if name not in self.known:
            begin = time.perf_counter()
            row = {"key": key, **run(*arguments)}
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a") as file:
                file.write(json.dumps(row) + "\n")
            self.known[name] = row
            print(f"  {' '.join(map(str, key.values()))}: {time.perf_counter() - begin:.0f} s", flush=True)
        return self.known[name]


def _name(key: dict) -> str:
    return json.dumps(key, sort_keys=True)
