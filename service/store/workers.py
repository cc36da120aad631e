"""The heartbeat of the workers: all SQL about it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from service.store.engine import reading, writing
from service.store.tables import workers


@dataclass(frozen=True)
class SeenWorker:
    """A worker that gave a sign of life, and the hash of its model file (None: missing)."""

    name: str
    model_sha256: str | None


class Workers:
    """The workers in the database."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def enter(self, name: str, model_sha256: str | None) -> None:
        """A worker starts."""
        now = datetime.now(UTC)
        with writing(self._engine) as connection:
            connection.execute(sa.delete(workers).where(workers.c.name == name))
            connection.execute(
                sa.insert(workers).values(name=name, model_sha256=model_sha256, started_at=now, seen_at=now)
            )

    def beat(self, name: str) -> bool:
        """A worker is alive; False if the others have given it up, then it must enter again."""
        with writing(self._engine) as connection:
            beat = sa.update(workers).where(workers.c.name == name).values(seen_at=datetime.now(UTC))
            return connection.execute(beat).rowcount == 1

    def alive(self, silence_s: float) -> list[SeenWorker]:
        """The workers that were seen within `silence_s`."""
        query = sa.select(workers.c.name, workers.c.model_sha256).where(workers.c.seen_at >= _ago(silence_s))
        with reading(self._engine) as connection:
            return [SeenWorker(row.name, row.model_sha256) for row in connection.execute(query)]

    def silent(self, silence_s: float) -> list[str]:
        """The workers that were not."""
        with reading(self._engine) as connection:
            return list(connection.scalars(sa.select(workers.c.name).where(workers.c.seen_at < _ago(silence_s))))

    def leave(self, name: str, silence_s: float) -> None:
        """Forget a worker, unless it has come back meanwhile."""
        with writing(self._engine) as connection:
            connection.execute(sa.delete(workers).where(workers.c.name == name, workers.c.seen_at < _ago(silence_s)))


def _ago(seconds: float) -> datetime:
    return datetime.now(UTC) - timedelta(seconds=seconds)
