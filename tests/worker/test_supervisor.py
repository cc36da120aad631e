"""Rounds of a worker that looks after the jobs of others."""

from datetime import timedelta
from types import SimpleNamespace

import sqlalchemy as sa

from service.store import tables
from worker import supervisor
from worker.heartbeat import BEAT_S

TAKEOVER_S = 10.0


class Clock:
    """Time of a worker, and the event for which it waits; `rounds` are the seconds of its waits until it stops."""

    def __init__(self, rounds):
        self.now = 1000.0
        self._rounds = iter(rounds)

    def monotonic(self):
        return self.now

    def wait(self, _):
        seconds = next(self._rounds, None)
        self.now += seconds or 0.0
        return seconds is None


class Queue:
    """Notes the time at which jobs of dead workers are taken over."""

    def __init__(self, clock):
        self.taken = []
        self._clock, self._begun = clock, clock.now

    def take_over(self, dead):
        self.taken.append((self._clock.now - self._begun, list(dead)))

    def forget(self, job_ids):
        """Forget no job: none is deleted."""


def taken_over(stock, monkeypatch, rounds):
    """Seconds until a worker takes over from one that is silent, and the names."""
    clock = Clock(rounds)
    queue = Queue(clock)
    monkeypatch.setattr(supervisor, "WorkerQueue", lambda *_: queue)
    monkeypatch.setattr(supervisor, "_run_duty", lambda *_: None)
    settings = stock.settings.model_copy(update={"takeover_after_s": TAKEOVER_S})
    worker = supervisor.Worker(settings, "here")
    worker._heartbeat.start()
    stock.workers.register("other", None)
    with stock.engine.begin() as connection:
        long_ago = stock.workers.now() - timedelta(minutes=1)
        connection.execute(sa.update(tables.workers).where(tables.workers.c.name == "other").values(seen_at=long_ago))
    monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=clock.monotonic))
    worker.run_until(clock)
    return queue.taken


def test_a_silent_worker_is_taken_for_dead_in_the_next_round(stock, monkeypatch):
    assert taken_over(stock, monkeypatch, [BEAT_S] * 3) == [(BEAT_S, ["other"])]


def test_after_an_outage_of_the_database_silent_workers_have_time_to_come_back(stock, monkeypatch):
    outage_s = 30.0
    assert taken_over(stock, monkeypatch, [outage_s] + [BEAT_S] * 7) == [(outage_s + TAKEOVER_S, ["other"])]
