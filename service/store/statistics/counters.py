"""Counters and histograms in the database: what has happened since it was made, whichever process did it.

A process that counts in its memory forgets when it dies, and a worker has no port to be asked at. So what is to be
counted is counted in the transaction that makes it true, and is true to the last job. The sets of labels are closed, so
that there are some two hundred rows and never more.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from service.store import tables

# A metric, and the values of its labels.
CounterKey = tuple[str, tuple[str, ...]]
Increments = dict[CounterKey, float]
INSERT: dict[str, Callable[[sa.Table], sqlite.Insert | postgresql.Insert]] = {
    "sqlite": sqlite.insert,
    "postgresql": postgresql.insert,
}
t = tables.tallies.c


@dataclass(frozen=True)
class HistogramBuckets:
    """A histogram among the counters: numbers of observations by upper bound, and their sum."""

    metric: str
    bounds: tuple[float, ...]

    def of(self, value: float, *labels: str) -> Increments:
        """Return the increments of one observation."""
        bound = next((f"{bound:g}" for bound in self.bounds if value <= bound), "inf")
        return {(f"{self.metric}_bucket", (*labels, bound)): 1, (f"{self.metric}_sum", labels): value}

    def read(self, tallies: Mapping[CounterKey, float], *labels: str) -> tuple[list[tuple[str, float]], float]:
        """Return cumulative counts by upper bound, as Prometheus has them, and the sum.

        What another release counted under bounds of its own is found below the next of these.
        """
        counts = {
            float(values[-1]): count
            for (metric, values), count in tallies.items()
            if metric == f"{self.metric}_bucket" and values[:-1] == labels
        }
        bounds = [(f"{bound:g}", bound) for bound in self.bounds] + [("+Inf", float("inf"))]
        cumulative = [(text, sum(n for upper, n in counts.items() if upper <= bound)) for text, bound in bounds]
        return cumulative, tallies.get((f"{self.metric}_sum", labels), 0.0)


SECONDS = (0.1, 0.25, 0.5, 1, 2.5, 5, 10, 25, 50, 100, 250, 500, 1000)
WAIT = HistogramBuckets("job_wait", (1, 2.5, 5, 10, 30, 60, 120, 300, 600, 1800, 3600))
DURATION = HistogramBuckets("job_duration", SECONDS)
STAGE = HistogramBuckets("job_stage", SECONDS)
STITCH_ERROR = HistogramBuckets("job_stitch_error", (0.1, 0.2, 0.3, 0.5, 0.75, 1, 1.5, 2, 3, 5, 10, 20, 50))


def add(connection: sa.Connection, amounts: Mapping[CounterKey, float]) -> None:
    """Add increments to the counters, inside the caller's transaction."""
    if not amounts:
        return
    # The rows in one order, so that no two transactions wait for each other.
    rows = [
        {"metric": metric, "labels": ",".join(labels), "value": amount}
        for (metric, labels), amount in sorted(amounts.items())
    ]
    connection.execute(_grow(connection.dialect.name), rows)


@cache
def _grow(dialect: str) -> sa.Executable:
    """Return the statement that adds to counters; its RETURNING lets one statement be sent for all rows."""
    insert = INSERT[dialect](tables.tallies)
    grown = {"value": t.value + insert.excluded.value}
    return insert.on_conflict_do_update(index_elements=["metric", "labels"], set_=grown).returning(t.metric)


def read(connection: sa.Connection) -> dict[CounterKey, float]:
    """Return all counters."""
    rows = connection.execute(sa.select(tables.tallies))
    return {(row.metric, tuple(row.labels.split(",")) if row.labels else ()): row.value for row in rows}


def total(parts: Iterable[Increments]) -> Increments:
    """Return the sum of increments."""
    amounts: Increments = {}
    for part in parts:
        for key, amount in part.items():
            amounts[key] = amounts.get(key, 0) + amount
    return amounts
