"""Cost of lists and pages when there are many jobs."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa

from benchmarks.printing import spread
from benchmarks.service.stage import homes
from service.schemas.options import Options
from service.schemas.venue import VenueIn
from service.store import tables
from service.store.jobs.queries import JobPage
from service.store.repositories import Repositories
from testbed.running import venue
from testbed.stock import result

VENUES, BATCH, LEAN_BATCH, ROUNDS, PAGE = 100, 5000, 500_000, 9, 51
# So many jobs down from a page on are whole: a page of the rarest takes one of a thousand.
WHOLE = 60_000
ID_START, AT = "01KAJ3Q6WZ5T3Y8R0N", datetime(2026, 11, 21, tzinfo=UTC)
# Of a thousand jobs, so many that are not calibrations with a result.
RARE = {0: ("failed", "calibration"), 1: ("cancelled", "calibration"), 2: ("succeeded", "locate")}
FILTERS: dict[str, dict[str, str | None]] = {
    "all": {},
    "succeeded": {"status": "succeeded"},
    "failed": {"status": "failed"},
    "queued": {"status": "queued"},
    "of a kind": {"kind": "locate"},
    "of a kind, failed": {"kind": "locate", "status": "failed"},
    "of a venue": {"venue": "v7"},
    "of a venue, failed": {"venue": "v7", "status": "failed"},
    "of a venue and a kind": {"venue": "v7", "kind": "locate"},
}


def table(options: argparse.Namespace) -> list[str]:
    """Milliseconds for the newest page of each list and for one in the middle, in both homes."""
    rows = [f"{options.listed_jobs} jobs of {VENUES} venues; pages of {PAGE - 1}; ms, median (least to most)", ""]
    with homes() as both, tempfile.TemporaryDirectory(prefix="esc-lists-") as name:
        folder = Path(name)
        stores = {called: Repositories(home.database_url(folder)) for called, home in both.items()}
        for store in stores.values():
            _fill(store, options.listed_jobs)
        rows += ["| list | " + " | ".join(stores) + " |", "|---|" + "---|" * len(stores)]
        for called, filters in FILTERS.items():
            wanted = {"venue": None, "status": None, "kind": None} | filters
            for place, before in (("newest", None), ("middle", _id(options.listed_jobs // 2))):
                cells = [spread(_times(store, wanted, before)) for store in stores.values()]
                rows.append(f"| {called}, {place} | " + " | ".join(cells) + " |")
        for store in stores.values():
            store.engine.dispose()
    return rows


def _times(store: Repositories, wanted: dict[str, str | None], before: str | None) -> list[float]:
    def page() -> float:
        begun = time.perf_counter()
        store.jobs.page(
            JobPage(PAGE, before=before, venue=wanted["venue"], status=wanted["status"], kind=wanted["kind"])
        )
        return 1e3 * (time.perf_counter() - begun)

    page()
    return [page() for _ in range(ROUNDS)]


def _fill(store: Repositories, jobs: int) -> None:
    """All jobs; whole ones where pages are read, and of the others what lists are sorted and chosen by.

    With their documents ten million would need 90 GB. No list reads those of jobs that it does not show.
    """
    middle = jobs // 2 + 1
    whole = [range(max(middle - WHOLE, 0), middle), range(max(jobs - WHOLE, middle), jobs)]
    with store.engine.begin() as connection:
        for first in range(0, jobs, LEAN_BATCH):
            connection.execute(_lean(first, min(first + LEAN_BATCH, jobs), whole))
        for numbers in whole:
            for first in range(numbers.start, numbers.stop, BATCH):
                connection.execute(sa.insert(tables.jobs), list(_rows(first, min(first + BATCH, numbers.stop))))
    if store.engine.dialect.name == "postgresql":
        # It does so by itself, after a while; SQLite does not.
        with store.engine.begin() as connection:
            connection.execute(sa.text("ANALYZE"))


def _lean(first: int, end: int, but: Sequence[range]) -> sa.Insert:
    """Jobs of these numbers without documents, made by the database itself."""
    numbers = sa.select(sa.literal(first).label("n")).cte("numbers", recursive=True)
    numbers = numbers.union_all(sa.select(numbers.c.n + 1).where(numbers.c.n + 1 < end))
    n = numbers.c.n
    rare = [(n % 1000 == number, kinds) for number, kinds in RARE.items()]
    lean = {
        "id": sa.literal(ID_START) + sa.func.substr(sa.cast(10**8 + n, sa.String), 2),
        "kind": sa.case(*((at, kind) for at, (_, kind) in rare), else_="calibration"),
        "venue": sa.literal("v") + sa.cast(n % VENUES * 19 % VENUES, sa.String),
        "status": sa.case(*((at, status) for at, (status, _) in rare), else_="succeeded"),
        "priority": sa.literal(100),
        "content_hash": sa.literal("c"),
        "attempt": sa.literal(1),
        "revision": sa.literal(5),
        **{name: sa.literal({}, tables.jobs.c[name].type) for name in ("options", "venue_document", "frames")},
        **{name: sa.literal(AT, tables.jobs.c[name].type) for name in ("created_at", "updated_at", "finished_at")},
    }
    chosen = sa.select(*lean.values()).where(*(sa.or_(n < each.start, n >= each.stop) for each in but))
    return sa.insert(tables.jobs).from_select([*lean], chosen, include_defaults=False)


def _rows(first: int, end: int) -> Iterator[dict[str, Any]]:
    stands = VenueIn.model_validate(venue("v")).to_venue()
    document, found = stands.model_dump(mode="json"), result(stands, accepted=True).model_dump(mode="json")
    asked = Options(seed=1).model_dump(mode="json")
    venues = np.random.default_rng(1).integers(0, VENUES, end - first)
    for number in range(first, end):
        status, kind = RARE.get(number % 1000, ("succeeded", "calibration"))
        yield {
            "id": _id(number),
            "kind": kind,
            "venue": f"v{venues[number - first]}",
            "status": status,
            "priority": 100,
            "options": asked,
            "content_hash": "c",
            "venue_document": document,
            "frames": {"left": ["frames/x/left/0"]},
            "attempt": 1,
            "revision": 5,
            "result": found if status == "succeeded" and kind == "calibration" else None,
            "created_at": AT,
            "updated_at": AT,
            "finished_at": AT,
        }


def _id(number: int) -> str:
    return f"{ID_START}{number:08d}"
