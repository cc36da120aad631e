"""What lists and pages cost when there are many jobs."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa

from service.store import tables
from service.store.stores import Stores
from service.wire.options import Options
from service.wire.venue import VenueIn
from tests.benchmarks.service.stage import homes, spread
from tests.e2e.running import venue
from tests.worker.stock import result

VENUES, BATCH, ROUNDS, PAGE = 100, 5000, 9, 51
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
        stores = {called: Stores(home.database_url(folder)) for called, home in both.items()}
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


def _times(store: Stores, wanted: dict[str, str | None], before: str | None) -> list[float]:
    def page() -> float:
        begun = time.perf_counter()
        store.jobs.page(wanted["venue"], wanted["status"], before, PAGE, wanted["kind"])
        return 1e3 * (time.perf_counter() - begun)

    page()
    return [page() for _ in range(ROUNDS)]


def _fill(store: Stores, jobs: int) -> None:
    with store.engine.begin() as connection:
        for first in range(0, jobs, BATCH):
            connection.execute(sa.insert(tables.jobs), list(_rows(first, min(first + BATCH, jobs))))
    if store.engine.dialect.name == "postgresql":
        # It does so by itself, after a while; SQLite does not.
        with store.engine.begin() as connection:
            connection.execute(sa.text("ANALYZE"))


def _rows(first: int, end: int) -> Iterator[dict[str, Any]]:
    stands = VenueIn.model_validate(venue("v")).stored()
    document, found = stands.model_dump(mode="json"), result(stands, accepted=True).model_dump(mode="json")
    at, asked = datetime(2026, 11, 21, tzinfo=UTC), Options(seed=1).model_dump(mode="json")
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
            "created_at": at,
            "updated_at": at,
            "finished_at": at,
        }


def _id(number: int) -> str:
    return f"01KAJ3Q6WZ5T3Y8R0N{number:08d}"
