"""The paper's ablation: what LeakyReLU and the focal loss bring, each alone and together, same budget for all four.

    python -m models.training.ablation --device cuda --workers 12

Trains what is not trained yet into `runs/ablation`, then prints the table: each variant with batch normalisation and
without it, all on the same batches of a seed. It may be stopped and called again. Each variant's threshold is chosen on
other crops than it is judged on.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from models.training.data.makers import Makers
from models.training.data.pool import Pool
from models.training.evaluate import rendered, unseen_crops
from models.training.network.export import export, load
from models.training.network.unet import LEAK, PAPER
from models.training.pitches.crops import CROP_SIZE
from models.training.pitches.render import Rendering
from models.training.train import Budget, Recipe, Training, train
from worker.calibration.detection.segmentation import Segmenter

FOLDER = Path("runs/ablation")
STEPS, BATCH, SIZE_PX = 4000, 6, 224
GAMMA = 1.0
SEEDS, SEED, KEPT = 3, 1, 4096
DRAWN_APART = 1_000_000
"""Between the crops of one training and those of the next: more than the steps that either may begin at."""
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
NORMALISED = {True: "with batch normalisation", False: "without"}


def main() -> None:
    """Train and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--seeds", type=int, default=SEEDS, help="trainings of each variant")
    parser.add_argument("--judged", type=int, default=200, help="rendered crops to judge on")
    parser.add_argument("--workers", type=int, default=1, help="processes that render")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    for seed in range(options.seeds):
        train_variants(options.steps, seed, options.workers, torch.device(options.device))
    print(*table(options.steps, options.seeds, options.judged, options.threads), sep="\n")


def train_variants(steps: int, seed: int, workers: int, device: torch.device) -> None:
    """All variants of a seed on the same batches of pitches alone, as far as they are not trained yet."""
    trainings = [
        Training(_recipe(variant, normalised), device, Budget(0, steps), _run(steps, seed), seed)
        for normalised in NORMALISED
        for variant in VARIANTS
    ]
    for training in trainings:
        training.checkpoint.parent.mkdir(parents=True, exist_ok=True)
        if training.checkpoint.exists():
            training.load()
    step = trainings[0].step
    if step < steps:
        drawn = SEED + seed * DRAWN_APART + step
        makers = Makers(CROP_SIZE, pitches=1.0, seed=drawn, workers=workers)
        train(trainings, Pool(makers, device, KEPT, SIZE_PX, repeats=3.0, seed=drawn), BATCH)


def table(steps: int, seeds: int, judged: int, threads: int) -> list[str]:
    """A row for each variant with and without normalisation: means over the seeds, and the spread of the F1."""
    tuned_on, judged_on = unseen_crops(judged // 2, VALIDATION), unseen_crops(judged)
    lines = [
        f"U-Net variants after {steps} steps, {seeds} seeds, {judged} rendered crops of other venues, %; ± over seeds",
        "",
        "| | | IoU | F1 | precision | recall | paper: mIoU | F1 |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for normalised, words in NORMALISED.items():
        for variant in VARIANTS:
            recipe = _recipe(variant, normalised)
            runs = [_figures(_run(steps, seed) / f"{recipe}.pt", tuned_on, judged_on, threads) for seed in range(seeds)]
            iou, f1, precision, recall = (
                100 * np.array([run[name] for run in runs]) for name in ("iou", "f1", "precision", "recall")
            )
            lines.append(
                f"| {variant.name} | {words} | {iou.mean():.1f} ± {iou.std():.1f} | {f1.mean():.1f} ± {f1.std():.1f} "
                f"| {precision.mean():.1f} | {recall.mean():.1f} | {variant.paper_miou} | {variant.paper_f1} |"
            )
    return lines


def _recipe(variant: Variant, normalised: bool) -> Recipe:
    return replace(variant.recipe, normalised=normalised)


def _run(steps: int, seed: int) -> Path:
    return FOLDER / f"{steps}-{seed}"


def _figures(
    checkpoint: Path, tuned_on: Sequence[Rendering], judged_on: Sequence[Rendering], threads: int
) -> dict[str, float]:
    """Figures on some crops, at the threshold that has the best F1 on others."""
    path = checkpoint.with_suffix(".onnx")
    export(load(checkpoint), path)
    segmenter = Segmenter(path, threads)
    best = max(rendered(segmenter, tuned_on), key=lambda row: row["f1"])["threshold"]
    return next(row for row in rendered(segmenter, judged_on) if row["threshold"] == best)


if __name__ == "__main__":
    main()
