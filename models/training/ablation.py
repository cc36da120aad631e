"""The paper's ablation: what LeakyReLU and the focal loss bring, each alone and together, same budget for all four.

    python -m models.training.ablation --steps 2000

Trains what is not trained yet into `runs/ablation`, all four on the same batches, then prints the table. Each variant's
threshold is chosen on other crops than it is judged on.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import torch

from models.training.data.makers import Makers
from models.training.data.pool import Pool
from models.training.evaluate import rendered
from models.training.network.export import export, load
from models.training.network.unet import LEAK, PAPER
from models.training.pitches.crops import CROP_SIZE
from models.training.train import Budget, Recipe, Training, train
from worker.calibration.see.segmentation import Segmenter

FOLDER = Path("runs/ablation")
STEPS, BATCH, SIZE_PX = 2000, 6, 224
GAMMA = 1.0
SEED, KEPT = 1, 4096
# Seed of worlds that neither training nor the test draws.
VALIDATION = 2**22


@dataclass(frozen=True)
class Variant:
    """A row of the paper's table, with the paper's figures."""

    name: str
    recipe: Recipe
    paper_miou: float
    paper_f1: float


VARIANTS = (
    Variant("U-Net", Recipe(PAPER, leak=0.0, gamma=0.0), 49.6, 65.8),
    Variant("LeakyReLU", Recipe(PAPER, leak=LEAK, gamma=0.0), 51.9, 68.0),
    Variant("focal loss", Recipe(PAPER, leak=0.0, gamma=GAMMA), 55.3, 71.9),
    Variant("both", Recipe(PAPER, leak=LEAK, gamma=GAMMA), 57.3, 73.6),
)


def trained(steps: int, workers: int, threads: int, device: torch.device) -> list[Path]:
    """A checkpoint of each variant, trained on pitches alone as far as it is not yet."""
    torch.set_num_threads(threads)
    run = FOLDER / f"{steps}"
    run.mkdir(parents=True, exist_ok=True)
    trainings = [Training(variant.recipe, device, Budget(0, steps), run) for variant in VARIANTS]
    for training in trainings:
        if training.checkpoint.exists():
            training.load()
    step = trainings[0].step
    if step < steps:
        makers = Makers(CROP_SIZE, pitches=1.0, seed=SEED + step, workers=workers)
        train(trainings, Pool(makers, device, KEPT, SIZE_PX, repeats=3.0, seed=SEED + step), BATCH)
    return [training.checkpoint for training in trainings]


def judge(checkpoint: Path, crops: int, threads: int) -> dict[str, float]:
    """Figures on the test crops, at the threshold with the best F1 on the validation crops."""
    path = checkpoint.with_suffix(".onnx")
    export(load(checkpoint), path)
    segmenter = Segmenter(path, threads)
    best = max(rendered(segmenter, crops // 2, VALIDATION), key=lambda row: row["f1"])["threshold"]
    return next(row for row in rendered(segmenter, crops) if row["threshold"] == best)


def main() -> None:
    """Train and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--judged", type=int, default=200, help="rendered crops to judge on")
    parser.add_argument("--workers", type=int, default=1, help="processes that render")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    options = parser.parse_args()
    checkpoints = trained(options.steps, options.workers, options.threads, torch.device(options.device))
    print(f"U-Net variants after {options.steps} steps, {options.judged} rendered crops of other venues, %\n")
    print("| | IoU | F1 | precision | recall | paper: mIoU | F1 |")
    print("|---|---|---|---|---|---|---|")
    for variant, checkpoint in zip(VARIANTS, checkpoints, strict=True):
        figures = judge(checkpoint, options.judged, options.threads)
        shares = " | ".join(f"{100 * figures[name]:.1f}" for name in ("iou", "f1", "precision", "recall"))
        print(f"| {variant.name} | {shares} | {variant.paper_miou} | {variant.paper_f1} |")


if __name__ == "__main__":
    main()
