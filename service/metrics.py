"""What Prometheus reads: requests as they come, jobs and workers as the database has them, and the disk."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import get_args

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from service.disk import Disk
from service.schemas import Status
from service.store.deliveries import Deliveries
from service.store.jobs import Jobs
from service.store.workers import Workers


class Metrics:
    """The figures of one API process."""

    def __init__(self, jobs: Jobs, workers: Workers, deliveries: Deliveries, disk: Disk, silence_s: float) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "esc_http_requests", "Requests answered.", ["method", "route", "status"], registry=self.registry
        )
        self.seconds = Histogram(
            "esc_http_request_seconds", "Time to answer.", ["method", "route"], registry=self.registry
        )
        self.registry.register(_Stored(jobs, workers, deliveries, disk, silence_s))


class _Stored(Collector):
    def __init__(self, jobs: Jobs, workers: Workers, deliveries: Deliveries, disk: Disk, silence_s: float) -> None:
        self._jobs = jobs
        self._workers = workers
        self._deliveries = deliveries
        self._disk = disk
        self._silence_s = silence_s

    def describe(self) -> Iterator[Metric]:
        """Nothing: registering must not read the database."""
        yield from ()

    def collect(self) -> Iterator[Metric]:
        """Read the database, and how full the disk is."""
        counts = self._jobs.counts()
        jobs = GaugeMetricFamily("esc_jobs", "Jobs by state.", labels=["status"])
        for status in get_args(Status):
            jobs.add_metric([status], counts.get(status, 0))
        yield jobs
        oldest = self._jobs.oldest_queued_at()
        age = 0.0 if oldest is None else (datetime.now(UTC) - oldest).total_seconds()
        yield GaugeMetricFamily("esc_queue_age_seconds", "How long the oldest queued job has waited.", value=age)
        alive = len(self._workers.alive(self._silence_s))
        yield GaugeMetricFamily("esc_workers", "Workers that gave a sign of life.", value=alive)
        told = self._deliveries.counts()
        callbacks = GaugeMetricFamily("esc_callbacks", "Callbacks of ended jobs.", labels=["status"])
        for status in ("waiting", "delivered", "given-up"):
            callbacks.add_metric([status], told.get(status, 0))
        yield callbacks
        free = self._disk.free_bytes()
        if free is not None:
            yield GaugeMetricFamily("esc_disk_free_bytes", "Free where database and files grow.", value=free)
