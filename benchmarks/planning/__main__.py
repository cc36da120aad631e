"""`make bench-plan`: whether calibrations are as exact as `esc plan` says, before any frame is taken.

    python -m benchmarks.planning --venues 6
    python -m benchmarks.planning --only rules

Sections: `states` (how much of the lines is measured, and how well: half of the venues chooses the noise model),
`ratios` (actual errors over predicted sigmas; the other half judges), `rules` (the table of rules of thumb of
docs/planning.md). Frames and answers are kept in `runs/bench`; remove `planning.jsonl` after a change of the engine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence

import cv2

from benchmarks.planning.judging import chosen_states, ratios
from benchmarks.planning.rules import rules
from benchmarks.planning.runs import THREADS, calibrated
from benchmarks.planning.venues import VENUES, BuiltVenue, built_venue
from benchmarks.printing import print_sections
from worker.calibration.planning.line_state import STATES

SECTIONS: dict[str, Callable[[Sequence[BuiltVenue]], Iterator[str]]] = {
    "states": chosen_states,
    "ratios": lambda venues: ratios(venues, dict(STATES)),
    "rules": lambda _: rules(),
}


def main() -> None:
    """Calibrate the venues that are not calibrated yet, and print what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="sections")
    parser.add_argument("--venues", type=int, default=VENUES, help="how many")
    options = parser.parse_args()
    cv2.setNumThreads(THREADS)
    venues = [built_venue(number) for number in range(options.venues)]
    if options.only != ["rules"]:
        for venue in venues:
            calibrated(venue)
    print_sections(options.only, SECTIONS, venues)


if __name__ == "__main__":
    main()
