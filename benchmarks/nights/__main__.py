"""`make bench-truth ONLY=nights`: whether a sequence of nights can make the engine confidently wrong.

    python -m benchmarks.nights --only single --number 1
    python -m benchmarks.nights

Each job begins where the last one ended, with what the venue remembers. `single`: cameras from measured lines without
pictures, by the hundred; `venues`: several cameras of a venue that does not match its model, over a hundred nights;
`rendered`: rendered 4K frames through a real service over HTTP, with a lens that is true, stepping or creeping.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor

from benchmarks.nights import rendered, single, venues
from benchmarks.printing import print_sections

SECTIONS = {"single": single.table, "venues": venues.table, "rendered": rendered.table}


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument(
        "--number", type=int, default=2, help="cameras of each view and focal length, or venues of each kind"
    )
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.processes) as executor:
        print_sections(options.only, SECTIONS, executor, options.number)


if __name__ == "__main__":
    main()
