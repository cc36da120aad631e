"""The heartbeat of the workers: all SQL about it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import sqlalchemy as sa

from service.store.engine import Repository, clock, reading, writing
from service.store.tables import workers


@dataclass(frozen=True)
class SeenWorker:
    """A worker, the seconds since its last sign of life, and the hash of its model file (None: missing)."""

    name: str
    silent_s: float
    model_sha256: str | None


class Workers(Repository):
    """The workers in the database. Their times are the database's: the clocks of several machines differ."""

    def enter(self, name: str, model_sha256: str | None) -> None:
        """A worker starts."""
        with writing(self._engine) as connection:
            now = clock(connection)
            connection.execute(sa.delete(workers).where(workers.c.name == name))
            connection.execute(
                sa.insert(workers).values(name=name, model_sha256=model_sha256, started_at=now, seen_at=now)
            )

    def beat(self, name: str) -> bool:
        """A worker is alive; False if the others have given it up, then it must enter again."""
        with writing(self._engine) as connection:
            beat = sa.update(workers).where(workers.c.name == name).values(seen_at=clock(connection))
            return connection.execute(beat).rowcount == 1

    def alive(self, silence_s: float) -> list[SeenWorker]:
        """The workers that were seen within `silence_s`."""
        with reading(self._engine) as connection:
            return [worker for worker in seen(connection, clock(connection)) if worker.silent_s <= silence_s]

    def silent(self, silence_s: float) -> list[str]:
        """The workers that were not."""
        with reading(self._engine) as connection:
            return [worker.name for worker in seen(connection, clock(connection)) if worker.silent_s > silence_s]

    def leave(self, name: str, silence_s: float) -> None:
        """Forget a worker, unless it has come back meanwhile."""
        with writing(self._engine) as connection:
            old = workers.c.seen_at < clock(connection) - timedelta(seconds=silence_s)
            connection.execute(sa.delete(workers).where(workers.c.name == name, old))


def seen(connection: sa.Connection, now: datetime) -> list[SeenWorker]:
    """All that were not given up, by name."""
    rows = connection.execute(sa.select(workers).order_by(workers.c.name))
    return [SeenWorker(row.name, max(0.0, (now - row.seen_at).total_seconds()), row.model_sha256) for row in rows]
