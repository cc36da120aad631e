"""Section `real`: frames of fields with known cameras. What is seen of their lines, and what becomes of starts."""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.fields.cases import FOLDER, Case, cases, started
from benchmarks.fields.engine import Engine, camera_row
from benchmarks.fields.judging import near, outcome, reasons, share
from benchmarks.fields.seeing import seen
from benchmarks.printing import table_head
from benchmarks.truth import apart

__all__ = ["FOLDER", "section"]

OUTCOMES = ("accepted and near", "accepted but wrong", "refused though near", "refused and off")


def section(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    """Yield what is seen and what is found, source by source."""
    if not (options.folder / "cases.json").is_file():
        yield f"The real frames are not there: put them into {options.folder}, with their cases.json."
        return
    chosen = cases(options.folder, options.cases)
    yield from _seeing(chosen, engine)
    yield from _starts(chosen, options, engine)


def _seeing(chosen: Sequence[Case], engine: Engine) -> Iterator[str]:
    sources: dict[str, list[dict]] = defaultdict(list)
    for case in chosen:
        key = {"seen": case.name, "model": engine.name}
        sources[case.source].append(engine.rows.remembered(key, seen, case, engine.segment))
    yield "At the reference pose; means over frames. Seconds and core-seconds per frame: medians."
    yield "Beyond chance: of what the evidence finds, the part that is not found beside the lines as well, 1 - c / f of"
    yield "found f and chance c. Precision: the part that is line if lines which can be seen are found whatever chance"
    yield "does and the others by chance, (f - c) / (f (1 - c))."
    yield ""
    yield table_head(
        "source | frames | network: recall (least) | precision | evidence: found (least) | by chance | beyond chance "
        "| precision | view, s (core-s) | network, s (core-s) | evidence, s (core-s)"
    )
    for source, rows in sources.items():
        recall, found, chance = ([row[name] for row in rows] for name in ("recall", "found", "by_chance"))
        precision = [row["precision"] for row in rows if row["precision"] is not None]
        beyond = [1 - min(1.0, row["by_chance"] / max(row["found"], 1e-9)) for row in rows]
        right = [part / (1 - row["by_chance"]) for part, row in zip(beyond, rows, strict=True)]
        yield (
            f"| {source} | {len(rows)} | {np.mean(recall):.3f} ({min(recall):.2f}) "
            f"| {np.mean(precision) if precision else np.nan:.3f} "
            f"| {np.mean(found):.3f} ({min(found):.2f}) | {np.mean(chance):.3f} | {np.mean(beyond):.3f} "
            f"| {np.mean(right):.3f} "
            f"| {_times(rows, 'view_s')} | {_times(rows, 'network_s')} | {_times(rows, 'evidence_s')} |"
        )
    yield ""
    yield table_head("source | marking | network: recall | evidence: found")
    for source, rows in sources.items():
        by_network, by_both = (_by_kind(row[f"{name}_by_marking"] for row in rows) for name in ("recall", "found"))
        for kind in sorted(by_network, key=by_network.__getitem__):
            yield f"| {source} | {kind} | {by_network[kind]:.2f} | {by_both.get(kind, float('nan')):.2f} |"
    yield ""


def _times(rows: Sequence[dict], name: str) -> str:
    wall, cpu = np.median([row[name] for row in rows], axis=0)
    return f"{wall:.2f} ({cpu:.2f})"


def _by_kind(frames: Iterator[dict]) -> dict[str, float]:
    """The share of each kind of marking, ends and dashes together, by the weights."""
    totals: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for frame in frames:
        for name, (weight, part) in frame.items():
            total = totals[re.sub(r"\b(left|right) |, dash \d+|(, \d+)+$", "", name)]
            total[0] += weight
            total[1] += weight * part
    return {kind: part / weight for kind, (weight, part) in totals.items() if weight}


def _starts(chosen: Sequence[Case], options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    venues: dict[str, list[Case]] = defaultdict(list)
    for case in chosen:
        venues[case.venue].append(case)
    sources: dict[str, list[dict]] = defaultdict(list)
    for venue, group in venues.items():
        for number in range(options.starts):
            key = {"start": venue, "n": number, "deg": options.turn, "cm": options.shift, "model": engine.name}
            row = engine.rows.remembered(key, _started, venue, group, number, options.turn, options.shift / 100, engine)
            for case in group:
                sources[case.source].append({**row, **row["cameras"][case.name], "case": case.name, "n": number})
    yield f"{options.starts} starts of each, {options.turn:g}° and {options.shift:g} cm off."
    yield ""
    yield f"| source | starts | {' | '.join(OUTCOMES)} | network in full | s | core-s |"
    yield "|---" * (len(OUTCOMES) + 5) + "|"
    for source, rows in sources.items():
        ends = [outcome(row["accepted"], row["near"]) for row in rows]
        seconds, cores = (np.median([row[name] for row in rows]) for name in ("seconds", "core_seconds"))
        cells = " | ".join(share([end == name for end in ends]) for name in OUTCOMES)
        in_full = sum(row["in_full"] > 0 for row in rows)
        yield f"| {source} | {len(rows)} | {cells} | {in_full} | {seconds:.1f} | {cores:.1f} |"
    yield ""
    for source, rows in sources.items():
        for name in OUTCOMES[2:]:
            ended = [row for row in rows if outcome(row["accepted"], row["near"]) == name]
            if ended:
                yield f"{source}, {name}: {reasons(ended)} ({', '.join(sorted({row['case'] for row in ended}))})"
        for row in rows:
            if row["accepted"] and not row["near"]:
                yield f"{source}, accepted but wrong: {row['case']}, start {row['n']}, {row['rms_px']:.1f} px"


def _started(venue: str, group: Sequence[Case], number: int, turn_deg: float, shift_m: float, engine: Engine) -> dict:
    stored = started([case.camera for case in group], venue, number, turn_deg, shift_m)
    frames = {case.name: [case.frame()] for case in group}
    answer = engine(group[0].pitch, stored, frames, number)
    found = {} if answer.said is None else {result.camera.id: result for result in answer.said.cameras}
    rows = {}
    for case in group:
        rows[case.name] = {"rms_px": None, "near": False}
        if case.name in found:
            there = found[case.name].camera
            rms = case.rms_px(there)
            metres, degrees = apart(there, case.camera)
            rows[case.name] = {
                "rms_px": rms,
                "near": near(rms, case.reference_px, case.tolerance_px),
                "shift_m": metres,
                "turn_deg": degrees,
                "accepted": found[case.name].accepted,
                "why": found[case.name].rejected_because or "",
                **camera_row(found[case.name]),
            }
    return {**answer.row, "cameras": rows}
