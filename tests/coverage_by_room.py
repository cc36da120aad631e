"""`python -m tests.coverage_by_room`: what `make coverage` has measured, a line for each room."""

import json
import tempfile
from collections import Counter
from pathlib import Path, PurePath
from typing import Any

import coverage

SUMS = ("num_statements", "missing_lines", "num_branches", "missing_branches")
# Folders whose folders are rooms.
HOUSES = (".", "service", "service/store", "service/routes", "worker", "worker/calibration")


def main() -> None:
    rooms: dict[str, Counter[str]] = {}
    for file, found in measured_files().items():
        # A copy elsewhere, as of a wheel that was tried.
        if PurePath(file).is_absolute():
            continue
        for room in (room_of(PurePath(file)), "all"):
            rooms.setdefault(room, Counter()).update({name: found["summary"][name] for name in SUMS})
    print(f"{'room':<36}{'lines':>8}{'missed':>8}{'branches':>10}{'missed':>8}{'reached':>9}")
    for room in sorted(rooms, key=lambda room: (room == "all", room)):
        lines, lines_missed, branches, branches_missed = (rooms[room][name] for name in SUMS)
        reached = 1 - (lines_missed + branches_missed) / max(lines + branches, 1)
        print(f"{room:<36}{lines:>8}{lines_missed:>8}{branches:>10}{branches_missed:>8}{reached:>9.1%}")


def measured_files() -> dict[str, Any]:
    """Return what coverage says of each file, by its path."""
    measured = coverage.Coverage()
    measured.load()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "coverage.json")
        measured.json_report(outfile=str(report))
        files: dict[str, Any] = json.loads(report.read_text())["files"]
    return files


def room_of(file: PurePath) -> str:
    folder = file.parent
    while str(folder) not in HOUSES and str(folder.parent) not in HOUSES:
        folder = folder.parent
    return str(folder)


if __name__ == "__main__":
    main()
