"""Limits of right and wrong answers, and reasons of refusals without their numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence

CAUGHT_M, CAUGHT_DEG = 0.01, 0.02
"""So near a rendered camera has to be found."""
WRONG_M = 0.3
"""Who is told a pose so far off is told wrong,"""
WRONG_SIGMAS = 3.0
"""or one that is so many times as far off as it claims to be."""
NEAR = 1.5
"""A real pose is near whose points are so many times as far off as the reference's at most, or within tolerance."""


def near(rms_px: float, reference_px: float, tolerance_px: float) -> bool:
    """True if a real camera was found, by the points measured in its frame."""
    return rms_px <= max(NEAR * reference_px, tolerance_px)


def outcome(accepted: bool, near: bool) -> str:
    """Return which of four ends a start came to."""
    if accepted:
        return "accepted and near" if near else "accepted but wrong"
    return "refused though near" if near else "refused and off"


def caught(row: dict) -> bool:
    """True if a rendered camera was accepted where it is."""
    return row["accepted"] and row["shift_m"] <= CAUGHT_M and row["turn_deg"] <= CAUGHT_DEG


def far_off(row: dict) -> bool:
    """True if a rendered camera was accepted where it is not."""
    return row["accepted"] and row["shift_m"] > WRONG_M


def overconfident(row: dict) -> bool:
    """True if a rendered camera was accepted farther off than three of its sigmas."""
    claims = ((row["shift_m"], row["sigma_m"]), (row["turn_deg"], row["sigma_deg"]))
    return row["accepted"] and any(said is not None and off > WRONG_SIGMAS * said for off, said in claims)


def reason(why: str) -> str:
    """A refusal without its cameras and its numbers: up to the first stop."""
    bare = re.sub(r"(the stored pose of )?camera \S+?:? ", "", why.split("; camera ")[0])
    return re.split(r"[:;,(]", re.sub(r"\d+(\.\d+)?", "N", bare))[0].strip()


def reasons(rows: Iterable[dict]) -> str:
    """Return the refusals with their counts, most frequent first."""
    counted = Counter(reason(row["why"]) for row in rows if not row["accepted"])
    return "; ".join(f"{count} x {text}" for text, count in counted.most_common())


def share(values: Sequence[bool]) -> str:
    """In hundredths; empty of nothing."""
    return f"{sum(values) / len(values):.2f}" if values else ""
