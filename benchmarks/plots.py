"""The plots of `make bench`, written to `docs/`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

DOCS = Path("docs")
FIGURES = (("stitch_px", "stitch error, px of 10 cm"), ("shift_cm", "position, cm"), ("turn_deg", "rotation, °"))


def table(rows: Sequence[dict]) -> list[Path]:
    """Each method's errors, a dot per venue and seed, on logarithmic scales."""
    methods = list(dict.fromkeys(row["method"] for row in rows))[::-1]
    figure, axes = plt.subplots(1, len(FIGURES), figsize=(11, 0.45 * len(methods) + 1.2), sharey=True)
    for axis, (name, label) in zip(axes, FIGURES, strict=True):
        for height, method in enumerate(methods):
            values = [row[name] for row in rows if row["method"] == method and row[name] is not None]
            axis.plot(np.maximum(values, 1e-4), np.full(len(values), height), "o", ms=4, alpha=0.4, color="tab:blue")
            if values:
                axis.plot(np.mean(values), height, "|", ms=16, mew=2, color="black")
        axis.set_xscale("log")
        axis.set_xlabel(label)
        axis.grid(axis="x", alpha=0.3)
    axes[0].set_yticks(range(len(methods)), [method.replace("`", "") for method in methods])
    return [_saved(figure, "accuracy")]


def tradeoff(rows: Mapping[float, Sequence[dict]]) -> Path:
    """Stitch and position error over `stitch_weight`."""
    weights = list(rows)
    figure, left = plt.subplots(figsize=(6, 3.4))
    right = left.twinx()
    for axis, name, colour, label in (
        (left, "stitch_px", "tab:blue", "stitch error, px of 10 cm"),
        (right, "shift_cm", "tab:orange", "position, cm"),
    ):
        axis.plot(weights, [np.mean([row[name] for row in rows[w]]) for w in weights], "o-", color=colour)
        axis.set_ylabel(label, color=colour)
        axis.set_ylim(bottom=0)
    left.set_xlabel("stitch_weight")
    left.grid(alpha=0.3)
    return _saved(figure, "tradeoff")


def convergence(curves: Sequence[Sequence[float]]) -> Path:
    """The best loss over the generations; it jumps where a finer level begins, sooner where nothing moves any more."""
    figure, axis = plt.subplots(figsize=(6, 3.4))
    for number, losses in enumerate(curves):
        axis.plot(np.arange(1, len(losses) + 1), losses, lw=1.2, label=f"start {number + 1}")
    axis.set_xlabel("generation")
    axis.set_ylabel("loss of the best")
    axis.set_ylim(0, 1.15 * max(max(losses) for losses in curves))
    axis.set_title("levels of blur, coarse to fine", fontsize=10)
    axis.legend(frameon=False, loc="lower left")
    axis.grid(alpha=0.3)
    return _saved(figure, "convergence")


def _saved(figure: plt.Figure, name: str) -> Path:
    path = DOCS / f"{name}.png"
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)
    return path
