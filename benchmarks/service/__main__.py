"""`make bench-service`: what crashes, load and months of work do to the service.

Prints a table per section. Real processes, real sockets, real SQLite, PostgreSQL and S3 (moto's server); where geometry
is not what is asked for, the program that computes a job is the stub of the tests.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable

from benchmarks.service import endurance, fleet, kills, load

SECTIONS: dict[str, Callable[[argparse.Namespace], list[str]]] = {
    "kills": kills.table,
    "takeovers": kills.takeovers,
    "pollers": load.table,
    "longrun": endurance.table,
    "fleet": fleet.table,
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--moments", type=int, default=20, help="at which one of two workers is killed")
    parser.add_argument("--seeds", type=int, default=40, help="by which a victim and a moment are drawn, one a round")
    parser.add_argument("--seed", type=int, help="the first of them; otherwise drawn, and printed")
    parser.add_argument("--rounds", type=int, default=7, help="jobs alone and jobs with pollers, alternately")
    parser.add_argument("--jobs", type=int, default=500, help="in a row, through the stub of the engine")
    parser.add_argument("--real-jobs", type=int, default=100, help="in a row, through the engine, at reduced size")
    parser.add_argument("--fleet-days", type=int, default=30, help="of a fleet in fast motion")
    parser.add_argument("--fleet-jobs", type=int, default=200, help="on each of these days")
    options = parser.parse_args()
    for name in options.only:
        print(f"\n## {name}\n", flush=True)
        print(*SECTIONS[name](options), sep="\n")
        print(f"\nLoad of the machine at the end (1, 5, 15 min): {', '.join(f'{x:.1f}' for x in os.getloadavg())}")


if __name__ == "__main__":
    main()
