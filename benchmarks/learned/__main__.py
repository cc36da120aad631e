"""Train what `make bench` compares with: `python -m benchmarks.learned`.

All nets that are asked for learn from the same batches; called again, it goes on where it stopped. The weights are
written to `benchmarks/learned/trained`. Some three hours of one core, or twenty minutes of a machine with a GPU:

    python -m benchmarks.learned --device cuda --workers 14
"""

from __future__ import annotations

import argparse

import cv2
import torch

from benchmarks.learned.nets import NETS
from benchmarks.learned.pool import Pool
from benchmarks.learned.training import Training, train
from benchmarks.learned.weights import missing


def main() -> None:
    """Train what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nets", nargs="+", choices=NETS, default=list(NETS), help="all, unless said")
    parser.add_argument("--steps", type=int, default=4500, help="of the whole schedule")
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--workers", type=int, default=0, help="processes that draw pairs; none: drawn in between")
    parser.add_argument("--kept", type=int, default=8192, help="pairs that are kept and shown again, 41 kB each")
    options = parser.parse_args()
    if "otle" in options.nets and "dhn" not in options.nets and (why := missing(("dhn",))):
        parser.error(f"otle begins where dhn guesses, and there are {why}")
    device = torch.device(options.device)
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    torch.manual_seed(0)
    trainings = [Training(name, NETS[name](), options.steps, device) for name in options.nets]
    begun = min(training.step for training in trainings)
    train(trainings, Pool(begun, device, options.kept, options.workers), options.batch)


if __name__ == "__main__":
    main()
