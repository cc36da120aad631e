"""`make bench`: how accurate, how wide and how fast the engine is, beside everything else that does the job.

    python -m benchmarks.accuracy --quick
    python -m benchmarks.accuracy --only table capture

Rendered venues (`scenes`), frames through the real U-Net, Start errors as in the paper. Every run is written to
`runs/bench/rows.jsonl` and not run again; remove the file after a change of the engine. Plots go to `docs/`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import cache, lru_cache

import cv2
import numpy as np

from benchmarks import plots
from benchmarks.methods import CLICKED, METHODS, SLOW, THREADS, Seen, cannot_run, engine
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER, VENUES, scene, started
from benchmarks.truth import Errors, apart, errors
from worker.calibration.calibrate import calibrate
from worker.calibration.geometry.camera import Camera
from worker.calibration.records import Options, Progress

CAUGHT_M, CAUGHT_DEG = 0.01, 0.01
PULLED_IN_DEG = 0.5
"""What the presets of the paper, which end without a finish, are asked for from 2.1 degrees."""
SEEDS, STARTS, SLOW_STARTS = 3, 100, 12
SLOW_VENUES = ("pair-match-1", "apart-match", "pair-real-1", "apart-real")
QUICK_VENUES = ("pair-match-1", "pair-real-1", "one-real")
QUICK_SECTIONS = ("table", "capture", "convergence")
PAPER = {
    "Start": "14.3 ± 3.5 | 16.2 ± 1.3 | 2.1 ± 0.4 | 96.2 ± 0.9",
    "Zhang (clicked corners)": "10.2 ± 1.1 | 5.0 ± 0.5 | 1.0 ± 0.1 | 98.3 ± 0.5",
    "DHN": "2.2 ± 0.5 | 12.6 ± 0.6 | 1.7 ± 0.2 | 97.1 ± 0.7",
    "OTLE": "8.8 ± 0.9 | 6.8 ± 0.5 | 1.3 ± 0.1 | 97.8 ± 0.6",
    "IHN": "6.8 ± 0.8 | 2.5 ± 0.4 | 0.7 ± 0.1 | 98.7 ± 0.4",
    "SCPR": "4.2 ± 0.6 | 0.5 ± 0.1 | 0.3 ± 0.0 | 99.1 ± 0.4",
    "ESC `paper`": "0.3 ± 0.1 | 0.2 ± 0.0 | 0.1 ± 0.0 | 99.4 ± 0.2",
    "ESC `esc`, flat": "0.7 ± 0.2 | 0.6 ± 0.1 | 0.4 ± 0.1 | ",
    "ESC `esc`, no stitch term": "3.7 ± 0.6 | 0.2 ± 0.0 | 0.1 ± 0.0 | ",
}
WEIGHTS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--quick", action="store_true", help="five minutes: three venues, one seed, ten starts, no slow presets"
    )
    parser.add_argument("--only", nargs="+", choices=SECTIONS, help="instead of all, or of the quick ones")
    parser.add_argument(
        "--methods", nargs="+", default=[""], help="of the table: those whose names contain one of these"
    )
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of each method on each venue")
    parser.add_argument("--slow-seeds", type=int, help="of the presets that take a minute")
    parser.add_argument("--slow-starts", type=int, default=SLOW_STARTS, help="of each of those presets")
    parser.add_argument("--starts", type=int, default=STARTS, help="of each size, to be caught")
    options = parser.parse_args()
    options.venues = QUICK_VENUES if options.quick else tuple(VENUES)
    if options.quick:
        options.seeds, options.starts = 1, 10
    if options.only is None:
        options.only = QUICK_SECTIONS if options.quick else tuple(SECTIONS)
    if options.slow_seeds is None:
        options.slow_seeds = 0 if options.quick else 1
    cv2.setNumThreads(THREADS)
    print_sections(options.only, SECTIONS, options)


def table(options: argparse.Namespace) -> Iterator[str]:
    """The paper's table, on venues that match their model and on venues that do not."""
    left_out = {method: why for method in METHODS if (why := cannot_run(method)) is not None}
    rows = [
        row
        for venue in options.venues
        for method in METHODS
        if method not in left_out and any(part in method for part in options.methods)
        for row in _rows(venue, method, _seeds(options, venue, method))
    ]
    for title, matches in (("Lens and roof match the model", True), ("They do not, as in reality", False)):
        yield f"{title}; mean ± sd over venues and seeds"
        yield ""
        yield table_head(" | Stitch, px | TrE, cm | RoE, ° | IoU, % | s | core-s | paper: Stitch | TrE | RoE | IoU")
        for method in METHODS:
            chosen = [row for row in rows if row["method"] == method and VENUES[row["venue"]][3] == matches]
            if chosen:
                yield f"| {method} | {_cells(chosen)} | {PAPER.get(method, ' | | | ')} |"
        yield ""
    yield from (f"{method} is left out: {why}." for method, why in left_out.items())
    yield from (f"![the table]({path})" for path in plots.table(rows))


def _seeds(options: argparse.Namespace, venue: str, method: str) -> int:
    """Return how often a method runs on a venue: those that take minutes run on a few."""
    if method not in SLOW:
        return options.seeds
    return options.slow_seeds if venue in SLOW_VENUES else 0


def _cells(rows: Sequence[dict]) -> str:
    def cell(name: str, digits: int, factor: float = 1.0) -> str:
        values = [factor * row[name] for row in rows if row.get(name) is not None]
        return f"{np.mean(values):.{digits}f} ± {np.std(values):.{digits}f}" if values else ""

    return " | ".join(
        (
            cell("stitch_px", 2),
            cell("shift_cm", 2),
            cell("turn_deg", 3),
            cell("iou", 2, 100),
            cell("seconds", 1),
            cell("core_seconds", 1),
        )
    )


def _rows(venue: str, method: str, seeds: int) -> Iterator[dict]:
    """One row per seed: errors and seconds of a method from a start of the paper's size."""
    for seed in range(seeds):
        key = {"venue": venue, "light": VENUES[venue][2], "method": method, "seed": seed}
        yield _remembered(key, _judge, venue, METHODS[method], seed)


def _judge(venue: str, method: Callable, seed: int) -> dict:
    seen = _seen(venue)
    answer = method(seen, started(seen.scene.cameras, np.random.default_rng([seed, 1])), seed)
    found = errors(seen.scene, answer.cameras) if answer.has_poses else Errors(answer.stitch_px)
    return {**asdict(found), "seconds": answer.seconds, "core_seconds": answer.core_seconds}


def capture(options: argparse.Namespace) -> Iterator[str]:
    """Count the starts that end where the same frames end when started from the truth."""
    yield table_head("start | caught | missed and accepted | missed and rejected")
    for size in (1.0, 2.0):
        rows = [
            _remembered({"venue": venue, "start": number, "size": size}, _caught, venue, number, size)
            for number in range(options.starts)
            for venue in [options.venues[number % len(options.venues)]]
        ]
        missed = [row for row in rows if not row["caught"]]
        bad = sum(row["accepted"] for row in missed)
        yield (
            f"| {16.2 * size:.1f} cm, {2.1 * size:.1f}° | {len(rows) - len(missed)} of {len(rows)} | {bad} "
            f"| {len(missed) - bad} |"
        )


def _caught(venue: str, number: int, size: float) -> dict:
    seen = _seen(venue)
    reference = _reference(venue)
    answer = engine()(seen, started(seen.scene.cameras, np.random.default_rng([number, 2]), size), number)
    assert answer.said is not None
    off = [apart(a, b) for a, b in zip(answer.cameras, reference, strict=True)]
    caught = all(shift <= CAUGHT_M and turn <= CAUGHT_DEG for shift, turn in off)
    return {
        "caught": caught,
        "accepted": answer.said.accepted,
        "apart_m": max(shift for shift, _ in off),
        "apart_deg": max(turn for _, turn in off),
        "why": answer.said.rejected_because,
    }


def presets(options: argparse.Namespace) -> Iterator[str]:
    """Count the starts from which the paper's presets end within `PULLED_IN_DEG`, beside clicked corners."""
    yield f"| from 2.1° | within {PULLED_IN_DEG}° | worst camera, median cm | ° | largest ° |"
    yield "|---|---|---|---|---|"
    for method in (*SLOW, CLICKED):
        rows = [
            _remembered({"venue": venue, "start": number, "preset": method}, _left, venue, number, method)
            for number in range(options.slow_starts)
            for venue in [SLOW_VENUES[number % len(SLOW_VENUES)]]
        ]
        turns = [row["turn_deg"] for row in rows]
        near = sum(turn <= PULLED_IN_DEG for turn in turns)
        shift = 100 * np.median([row["shift_m"] for row in rows])
        yield f"| {method} | {near} of {len(rows)} | {shift:.1f} | {np.median(turns):.3f} | {max(turns):.3f} |"


def _left(venue: str, number: int, method: str) -> dict:
    """Run a method from a start, and return the errors of its worst camera."""
    seen = _seen(venue)
    true = seen.scene.cameras
    found = METHODS[method](seen, started(true, np.random.default_rng([number, 2])), number).cameras
    off = [apart(a, b) for a, b in zip(found, true, strict=True)]
    return {"shift_m": max(shift for shift, _ in off), "turn_deg": max(turn for _, turn in off)}


def tradeoff(options: argparse.Namespace) -> Iterator[str]:
    """Stitch against metric accuracy over `stitch_weight`, on venues with several cameras that do not match."""
    venues = [name for name in options.venues if not VENUES[name][3] and VENUES[name][0] != "one"]
    yield table_head("stitch_weight | Stitch, px | TrE, cm | RoE, ° | IoU, % | s | core-s")
    rows = {}
    for weight in WEIGHTS:
        rows[weight] = [
            _remembered({"venue": venue, "weight": weight}, _judge, venue, engine(stitch_weight=weight), 0)
            for venue in venues
        ]
        yield f"| {weight} | {_cells(rows[weight])} |"
    yield ""
    yield f"![the trade-off]({plots.tradeoff(rows)})"


def convergence(_options: argparse.Namespace) -> Iterator[str]:
    """The loss over the generations, level by level."""
    seen = _seen("pair-real-1")
    curves = []
    for seed in range(3):
        losses: list[float] = []

        def note(step: Progress, losses: list[float] = losses) -> None:
            if step.loss is not None:
                losses.append(step.loss)

        begin = started(seen.scene.cameras, np.random.default_rng([seed, 1]))
        calibrate(seen.scene.pitch, begin, seen.scene.frames, seen.segment, Options(seed=seed), note)
        curves.append(losses)
    yield f"![the loss over the generations]({plots.convergence(curves)})"


SECTIONS: dict[str, Callable[[argparse.Namespace], Iterator[str]]] = {
    "table": table,
    "capture": capture,
    "presets": presets,
    "tradeoff": tradeoff,
    "convergence": convergence,
}


@lru_cache(maxsize=12)
def _seen(venue: str) -> Seen:
    """A scene and what the network says of it; the last few are kept."""
    return Seen(scene(venue))


@cache
def _reference(venue: str) -> list[Camera]:
    """Return where the frames of a venue end when they start from the truth."""
    seen = _seen(venue)
    return engine()(seen, seen.scene.cameras, 10_000).cameras


def _remembered(key: dict, run: Callable[..., dict], *arguments: object) -> dict:
    """The row of a key, from the file or run now and appended to it."""
    return {k: key[k] for k in ("venue", "method") if k in key} | _rows_of_file().remembered(key, run, *arguments)


@cache
def _rows_of_file() -> Rows:
    return Rows(FOLDER / "rows.jsonl")


if __name__ == "__main__":
    main()
