"""`make bench-segmentation`: what the U-Net finds, under which conditions, and how fast.

Prints five tables: the paper's ablation (trains the four variants if they are not there), the real pair, 4K against one
pass over the whole frame, tiles and batches, conditions.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import torch

from benchmarks.printing import print_sections
from models import MODEL_PATH
from models.training import ablation
from models.training.evaluate import by_condition, read_venue, real, rendered
from testbed.real_pair import FOLDER as REAL_PAIR
from worker.calibration.detection.segmentation import Segmenter, reachable_regions
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.steps import CAPTURE_RAD

DEMO = Path(__file__).parents[1] / "demo"
THREADS = 2
ROUNDS = 5


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=ablation.STEPS, help="of training per variant of the ablation")
    parser.add_argument("--seeds", type=int, default=ablation.SEEDS, help="trainings per variant of the ablation")
    parser.add_argument("--crops", type=int, default=200, help="rendered crops to judge on")
    parser.add_argument("--views", type=int, default=80, help="rendered views per condition")
    parser.add_argument(
        "--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="the ablation takes half a day"
    )
    parser.add_argument("--measure", choices=PASSES, help=argparse.SUPPRESS)  # this program, calling itself
    options = parser.parse_args()
    if options.measure:
        print(json.dumps(measured(PASSES[options.measure])))
        return
    print_sections(options.only, SECTIONS, options)


def four_k(_options: argparse.Namespace) -> list[str]:
    """Seconds and memory for a demo frame: everything in one pass against what the engine does, alternately."""
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in PASSES}
    for _ in range(ROUNDS):
        for name, seen in runs.items():
            command = [sys.executable, "-m", "benchmarks.segmentation", "--measure", name]
            seen.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    seconds = {name: float(np.median([run["seconds"] for run in seen])) for name, seen in runs.items()}
    memory = {name: max(run["peak_mb"] for run in seen) for name, seen in runs.items()}
    return [
        f"A 3840 x 2160 frame at the demo's pose, {THREADS} threads; median of {ROUNDS} processes, after a warm-up.",
        "",
        "| | s per frame | peak of resident memory, MB |",
        "|---|---|---|",
        *(f"| {name} | {seconds[name]:.2f} | {memory[name]:.0f} |" for name in PASSES),
        "",
        f"{seconds['whole frame'] / seconds['engine']:.1f} times faster.",
    ]


def measured(run: Callable[[], Callable[[], object]]) -> dict[str, float]:
    """Seconds of one pass after a warm-up, and the peak of this process's resident memory."""
    once = run()
    once()
    begin = time.perf_counter()
    once()
    seconds = time.perf_counter() - begin
    return {"seconds": seconds, "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000}


def _whole_frame() -> Callable[[], object]:
    """The network over the frame as it is."""
    _, _, frame = _demo_camera()
    padded = cv2.copyMakeBorder(frame, 0, -len(frame) % 32, 0, 0, cv2.BORDER_REFLECT_101)
    segmenter = Segmenter(MODEL_PATH, THREADS)
    return lambda: segmenter.session.run(
        None, {segmenter.input_name: padded[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255}
    )


def _engine() -> Callable[[], object]:
    """Return the pass that a calibration makes."""
    pitch, camera, frame = _demo_camera()
    segmenter = Segmenter(MODEL_PATH, THREADS)
    reach = CAPTURE_RAD * camera.intrinsics.matrix[0, 0]
    return lambda: segmenter(frame, reachable_regions(pitch, camera, reach))


PASSES = {"whole frame": _whole_frame, "engine": _engine}


def _demo_camera() -> tuple[Field, Camera, np.ndarray]:
    pitch, cameras = read_venue(DEMO / "venue.json")
    camera = cameras["left"]
    return pitch, camera, cv2.imread(str(DEMO / f"{camera.id}.jpg"), cv2.IMREAD_COLOR)


def tiles(_options: argparse.Namespace) -> list[str]:
    """Milliseconds per megapixel of answer over the threads, the side of tiles and how many are taken at once."""
    sides, batches = (256, 416, 640, 832, 1280), (1, 2, 4)
    lines = [
        "Milliseconds per megapixel without the halo of 96 px, which every tile pays.",
        "",
        "| threads | side, px | " + " | ".join(f"{count} at once" for count in batches) + " |",
        "|---|---|" + "---|" * len(batches),
    ]
    for threads in (1, 2):
        segmenter = Segmenter(MODEL_PATH, threads)
        for side in sides:
            cells = " | ".join(f"{_milliseconds(segmenter, side, count):.0f}" for count in batches)
            lines.append(f"| {threads} | {side} | {cells} |")
    return lines


def _milliseconds(segmenter: Segmenter, side: int, count: int) -> float:
    picture = np.random.default_rng(0).random((count, 3, side + 192, side + 192), dtype=np.float32)
    seconds = []
    for _ in range(4):
        begin = time.perf_counter()
        segmenter.session.run(None, {segmenter.input_name: picture})
        seconds.append(time.perf_counter() - begin)
    return 1000 * float(np.median(seconds[1:])) / (count * side * side / 1e6)


def conditions(options: argparse.Namespace) -> list[str]:
    """F1 by condition."""
    figures = by_condition(Segmenter(MODEL_PATH, THREADS), options.views)
    best = max(row["f1"] for row in figures.values())
    return [
        f"{options.views} views of venues that training never draws, the same under each condition; per pixel, %.",
        "",
        "| | F1 | of the best | recall | precision |",
        "|---|---|---|---|---|",
        *(
            f"| {name} | {100 * row['f1']:.1f} | {100 * row['f1'] / best:.0f} | {100 * row['recall']:.1f} "
            f"| {100 * row['precision']:.1f} |"
            for name, row in figures.items()
        ),
    ]


def real_pair(_options: argparse.Namespace) -> list[str]:
    """Recall, precision and false alarms on the real frames, where they are."""
    if not REAL_PAIR.is_dir():
        return [f"Not there: put it into {REAL_PAIR}."]
    return [
        "Tolerance 3 px; precision inside the pitch and 5 m around; false alarms farther than 1 m from any marking.",
        "",
        "| frame | recall | precision | false alarms, % |",
        "|---|---|---|---|",
        *(
            f"| {name} | {row.recall:.3f} | {row.precision:.3f} | {100 * row.false_alarms:.3f} |"
            for name, row in real(Segmenter(MODEL_PATH, THREADS), REAL_PAIR, None).items()
        ),
    ]


def unseen(options: argparse.Namespace) -> list[str]:
    """The committed model on the crops that the ablation is judged on."""
    rows = rendered(Segmenter(MODEL_PATH, THREADS), options.crops)
    row = max(rows, key=lambda row: row["f1"])
    return [
        f"The committed model, {options.crops} crops, per pixel at its best threshold there, {row['threshold']}, %.",
        "",
        "| IoU | F1 | precision | recall | false alarms |",
        "|---|---|---|---|---|",
        f"| {100 * row['iou']:.1f} | {100 * row['f1']:.1f} | {100 * row['precision']:.1f} | {100 * row['recall']:.1f} "
        f"| {100 * row['false_alarms']:.2f} |",
    ]


def ablated(options: argparse.Namespace) -> list[str]:
    """The paper's ablation."""
    torch.set_num_threads(THREADS)
    for seed in range(options.seeds):
        ablation.train_variants(options.steps, seed, 1, torch.device("cpu"))
    return ablation.table(options.steps, options.seeds, options.crops, THREADS)


SECTIONS: dict[str, Callable[[argparse.Namespace], list[str]]] = {
    "4k": four_k,
    "tiles": tiles,
    "conditions": conditions,
    "real": real_pair,
    "unseen": unseen,
    "ablation": ablated,
}


if __name__ == "__main__":
    main()
