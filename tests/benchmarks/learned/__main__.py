"""Train what `make bench` compares with: `python -m tests.benchmarks.learned`.

An hour of one core for each net by default; called again, it goes on where it stopped. The weights are kept in
`runs/bench/learned`.

    nice -n 19 python -m tests.benchmarks.learned --nets dhn --minutes 20
"""

from __future__ import annotations

import argparse

import cv2
import torch

from tests.benchmarks.learned.nets import NETS
from tests.benchmarks.learned.training import trained
from tests.benchmarks.learned.weights import missing


def main() -> None:
    """Train what is asked for, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nets", nargs="+", choices=NETS, default=list(NETS), help="all, unless said")
    parser.add_argument("--minutes", type=float, default=60.0, help="of one core, for each net")
    options = parser.parse_args()
    if "otle" in options.nets and "dhn" not in options.nets and (why := missing(("dhn",))):
        parser.error(f"otle begins where dhn guesses, and there are {why}")
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    for name in options.nets:
        torch.manual_seed(0)
        trained(name, NETS[name](), options.minutes)


if __name__ == "__main__":
    main()
