"""The paper's ablation: what LeakyReLU and the focal loss bring, each alone and together, same budget for all four.

    python -m models.training.ablation --steps 2000

Trains what is not trained yet into `runs/ablation` (all four see the same rendered crops in the same order), then
prints the table. Each variant's threshold is chosen on other crops than it is judged on.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from models.training.data.cache import start_workers
from models.training.evaluate import rendered
from models.training.network.export import export, load
from models.training.network.unet import LEAK
from worker.calibration.see.segmentation import Segmenter

FOLDER = Path("runs/ablation")
STEPS = 2000
GAMMA = 1.0
SEED, WORKERS, SHARDS = 1, 2, 32
# Seed of worlds that neither training nor the test draws.
VALIDATION = 2**22


@dataclass(frozen=True)
class Variant:
    """A row of the paper's table: slope of the activation below 0, exponent of the focal loss, the paper's figures."""

    name: str
    leak: float
    gamma: float
    paper_miou: float
    paper_f1: float


VARIANTS = (
    Variant("U-Net", 0.0, 0.0, 49.6, 65.8),
    Variant("LeakyReLU", LEAK, 0.0, 51.9, 68.0),
    Variant("focal loss", 0.0, GAMMA, 55.3, 71.9),
    Variant("both", LEAK, GAMMA, 57.3, 73.6),
)


def _render(crops: Path) -> None:
    """The same crops for all, before the first one learns."""
    for worker in start_workers(crops, SEED, WORKERS, SHARDS):
        worker.join()


def train(variant: Variant, steps: int, crops: Path, threads: int) -> Path:
    """The checkpoint of a variant, trained as far as it is not yet."""
    run = FOLDER / f"{variant.name.replace(' ', '-').lower()}-{steps}"
    command = [
        sys.executable,
        "-m",
        "models.training.train",
        "--run",
        run,
        "--crops",
        crops,
        "--no-export",
        "--workers",
        0,
    ]
    command += ["--steps", steps, "--leak", variant.leak, "--gamma", variant.gamma, "--threads", threads]
    subprocess.run([str(part) for part in command], check=True)
    return run / "checkpoint.pt"


def judge(checkpoint: Path, leak: float, crops: int, threads: int) -> dict[str, float]:
    """Figures on the test crops, at the threshold with the best F1 on the validation crops."""
    path = checkpoint.with_name("unet.onnx")
    export(load(checkpoint, leak), path)
    segmenter = Segmenter(path, threads)
    best = max(rendered(segmenter, crops // 2, VALIDATION), key=lambda row: row["f1"])["threshold"]
    return next(row for row in rendered(segmenter, crops) if row["threshold"] == best)


def table(steps: int, crops: Path, judged: int, threads: int) -> list[str]:
    """The ablation as lines of Markdown."""
    _render(crops)
    lines = [
        f"U-Net variants after {steps} steps each, {judged} rendered crops of venues that training never draws, %",
        "",
        "| | IoU | F1 | precision | recall | paper: mIoU | F1 |",
        "|---|---|---|---|---|---|---|",
    ]
    for variant in VARIANTS:
        figures = judge(train(variant, steps, crops, threads), variant.leak, judged, threads)
        shares = " | ".join(f"{100 * figures[name]:.1f}" for name in ("iou", "f1", "precision", "recall"))
        lines.append(f"| {variant.name} | {shares} | {variant.paper_miou} | {variant.paper_f1} |")
    return lines


def main() -> None:
    """Train and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--crops", type=Path, default=FOLDER / "crops", help="folder of rendered crops")
    parser.add_argument("--judged", type=int, default=200, help="rendered crops to judge on")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    print("\n".join(table(options.steps, options.crops, options.judged, options.threads)))


if __name__ == "__main__":
    main()
