"""Metrics for Prometheus.

Each process counts the requests that it answers. Everything else is read from the database at each scrape, so that
every API process shows the same, and restarts of workers lose nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import get_args

import structlog
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, InfoMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from service import build
from service.observability.disk import Disk, spool_free_bytes
from service.schemas.health import AlarmRule
from service.store.alarms import BEGUN
from service.store.database import DATABASE_OUTAGES
from service.store.events.outbox import CALLBACKS
from service.store.jobs.submission import PRIORITIES
from service.store.statistics.counters import DURATION, STAGE, STITCH_ERROR, WAIT, CounterKey, HistogramBuckets
from service.store.statistics.job_outcome import (
    ENDED,
    OTHER_OUTCOMES,
    OTHERS_ENDED,
    OUTCOMES,
    RESTARTS,
    STAGES,
    VIEW_CONDITIONS,
    VIEWS,
)
from service.store.statistics.snapshot import QueuedJobs, StatisticsSnapshot
from service.store.statistics.source_timings import FETCH, FRAME, NONE
from service.store.unreadable import RowKind, unreadable_rows
from service.store.workers import WorkerHeartbeat

# Gauges of venues, cameras and live poses: name, help, and which figure it shows.
OF_VENUES = (
    (
        "esc_venue_stitch_error_pixels",
        "Stitch error of the current poses, by the last result; 1 px is 10 cm.",
        "stitch_error_px",
    ),
    ("esc_venue_moved_pixels", "Largest movement of a camera in the last result.", "moved_px"),
    ("esc_venue_drift_pixels", "Largest movement of a camera since its pose was set.", "drift_px"),
    ("esc_venue_accepted_timestamp_seconds", "Time at which poses were last accepted.", "accepted_at"),
)
OF_CAMERAS = (
    (
        "esc_camera_trend_meters",
        "Distance of the camera's moving average from its baseline, at the far touchline.",
        "moved_m",
    ),
    (
        "esc_camera_trend_cusum",
        "Largest cumulative sum of the camera's control charts, in standard deviations; above 5 it has moved.",
        "cusum",
    ),
    (
        "esc_camera_trend_beyond",
        "1 while a control chart of the camera, EWMA or CUSUM, is beyond its limit.",
        "beyond",
    ),
)
OF_LIVE_POSES = (
    (
        "esc_live_running",
        "1 while the process that sends the venue's live poses reports; absent after a day without reports.",
        "running",
    ),
    (
        "esc_live_measured_ratio",
        "Share of the tracked cameras' pictures in which lines were measured, over the last one to two minutes.",
        "measured_share",
    ),
    (
        "esc_live_latency_p99_seconds",
        "Latency from the arrival of a picture to the sending of its pose, of the slowest camera over ten seconds.",
        "latency_p99_s",
    ),
)
# Counters of the database: name, help, labels, the key of the counter, and the closed set of what its labels can be.
COUNTERS: Sequence[tuple[str, str, Sequence[str], str, Sequence[tuple[str, ...]]]] = (
    ("esc_jobs_ended", "Calibrations by their end.", ["status", "verdict", "error"], ENDED, OUTCOMES),
    (
        "esc_other_jobs_ended",
        "Jobs of other kinds than calibrations by their end.",
        ["kind", "status"],
        OTHERS_ENDED,
        OTHER_OUTCOMES,
    ),
    (
        "esc_views",
        "Cameras in calibrations by their frames: usable, or why not.",
        ["condition"],
        VIEWS,
        [(condition,) for condition in VIEW_CONDITIONS],
    ),
    ("esc_job_restarts", "Attempts after a job's first one, whose worker died or was stopped.", [], RESTARTS, [()]),
    ("esc_alarms_begun", "Alarms that began.", ["rule"], BEGUN, [(rule,) for rule in get_args(AlarmRule)]),
    (
        "esc_callbacks",
        "Callbacks that will not be retried.",
        ["outcome"],
        CALLBACKS,
        [("delivered",), ("given-up",), ("expired",)],
    ),
)
# Histograms of the database: name, help, buckets, label and its values.
HISTOGRAMS: Sequence[tuple[str, str, HistogramBuckets, str, Sequence[str]]] = (
    ("esc_job_wait_seconds", "Time from submission to start of calibrations.", WAIT, "", ()),
    ("esc_job_duration_seconds", "Time from start to end of calibrations.", DURATION, "", ()),
    ("esc_job_stage_duration_seconds", "Durations of stages of jobs with a result.", STAGE, "stage", STAGES),
    ("esc_job_stitch_error_pixels", "Stitch errors of found poses; 1 px is 10 cm.", STITCH_ERROR, "", ()),
    (
        "esc_source_fetch_seconds",
        "Durations of fetches from sources of cameras, by outcome.",
        FETCH,
        "outcome",
        (FRAME, NONE),
    ),
)
log = structlog.get_logger()


class Metrics:
    """Metrics of one API process and, through `read`, of the service."""

    def __init__(self, read: Callable[[], StatisticsSnapshot], disk: Disk, silence_s: float) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "esc_http_requests", "Requests answered.", ["method", "route", "status"], registry=self.registry
        )
        self.seconds = Histogram(
            "esc_http_request_duration_seconds",
            "Time to answer; routes that end in ?wait are long polls.",
            ["method", "route"],
            registry=self.registry,
        )
        self.parts = Gauge(
            "esc_part_up",
            "1 if a part of the service works, as in /readyz of this process.",
            ["part"],
            registry=self.registry,
        )
        ProcessCollector(registry=self.registry)
        self.registry.register(_StoredMetrics(read, disk, silence_s))


class _StoredMetrics(Collector):
    def __init__(self, read: Callable[[], StatisticsSnapshot], disk: Disk, silence_s: float) -> None:
        self._read = read
        self._disk = disk
        self._silence_s = silence_s

    def describe(self) -> Iterator[Metric]:
        """Yield nothing, so that registering does not read the database."""
        yield from ()

    def collect(self) -> Iterator[Metric]:
        """Read database and disk; metrics that cannot be read are missing."""
        yield InfoMetricFamily(
            "esc_build", "The version.", {"version": build.version(), "commit": build.commit() or ""}
        )
        yield from self._room()
        yield _unreadable()
        try:
            figures = self._read()
        except DATABASE_OUTAGES:
            log.warning("no figures for Prometheus", exc_info=True)
            yield _gauge("esc_database_up", "1 if the database answers.", 0)
            return
        yield _gauge("esc_database_up", "1 if the database answers.", 1)
        yield from _queue(figures)
        yield from _counters(figures.counters)
        yield _gauges(
            "esc_schedule_late_seconds",
            "Delay of the schedule that has been due for longest, by the answers of its cameras the last time.",
            ["cameras"],
            zip([["answered"], ["slow-or-silent"]], figures.schedules_late_s, strict=True),
        )
        # The worst of each, as many as the setting `metrics_venues` allows.
        for families, rows, labels in (
            (OF_VENUES, figures.venues, ["venue"]),
            (OF_CAMERAS, figures.trends, ["venue", "camera"]),
            (OF_LIVE_POSES, figures.live, ["venue"]),
        ):
            for name, meaning, figure in families:
                samples = [([getattr(row, label) for label in labels], getattr(row, figure)) for row in rows]
                yield _gauges(name, meaning, labels, samples)
        yield from _alarms(figures)
        yield from _workers(figures.workers, self._silence_s)
        yield _gauge("esc_callbacks_waiting", "Callbacks that are due or will be retried.", figures.callbacks_waiting)

    def _room(self) -> Iterator[Metric]:
        try:
            free, spool = self._disk.free_bytes(), spool_free_bytes()
        except OSError:
            log.warning("cannot read how full the disk is", exc_info=True)
            return
        yield _gauge("esc_upload_free_bytes", "Free space for arriving uploads on this machine.", spool)
        if free is not None:
            yield _gauge("esc_disk_free_bytes", "Free space for database and files.", free)
            yield _gauge(
                "esc_disk_needed_bytes", "Free space below which uploads are refused.", self._disk.min_free_bytes
            )


def _unreadable() -> Metric:
    counts = unreadable_rows()
    return _gauges(
        "esc_unreadable_rows",
        "Stored rows that this process could not read within the last hour; its log names them.",
        ["kind"],
        [([kind], counts[kind]) for kind in get_args(RowKind)],
    )


def _queue(figures: StatisticsSnapshot) -> Iterator[Metric]:
    queued = [(name, figures.queue.get(number, QueuedJobs(0, 0))) for name, number in PRIORITIES.items()]
    jobs = [([name], waiting.jobs) for name, waiting in queued]
    yield _gauges("esc_queue_jobs", "Jobs in the queue.", ["priority"], jobs)
    ages = [([name], waiting.oldest_s) for name, waiting in queued]
    yield _gauges("esc_queue_oldest_age_seconds", "Age of the oldest queued job.", ["priority"], ages)
    yield _gauge("esc_jobs_running", "Running jobs.", figures.running)


def _counters(counters: Mapping[CounterKey, float]) -> Iterator[Metric]:
    """Yield what the database has counted, 0 where nothing was."""
    for name, meaning, labels, metric, outcomes in COUNTERS:
        counted = CounterMetricFamily(name, meaning, labels=labels)
        for outcome in outcomes:
            counted.add_metric(outcome, counters.get((metric, outcome), 0))
        yield counted
    for name, meaning, buckets, label, values in HISTOGRAMS:
        timed = HistogramMetricFamily(name, meaning, labels=[label] if label else [])
        for of in [[value] for value in values] or [[]]:
            timed.add_metric(of, *buckets.read(counters, *of))
        yield timed


def _alarms(figures: StatisticsSnapshot) -> Iterator[Metric]:
    active = [([rule], figures.alarms.get(rule, 0)) for rule in get_args(AlarmRule)]
    yield _gauges("esc_alarms", "Active alarms of venues and cameras.", ["rule"], active)
    ringing = [([alarm.venue, alarm.rule], 1) for alarm in figures.ringing]
    yield _gauges("esc_venue_alarm", "1 for an active alarm, oldest first.", ["venue", "rule"], ringing)


def _workers(workers: Sequence[WorkerHeartbeat], silence_s: float) -> Iterator[Metric]:
    alive = [worker.is_alive(silence_s) for worker in workers]
    yield _gauge("esc_workers", "Workers with a recent heartbeat.", sum(alive))
    for name, meaning, values in (
        ("esc_worker_up", "1 for a worker with a recent heartbeat.", alive),
        ("esc_worker_heartbeat_age_seconds", "Time since its last heartbeat.", [one.silent_s for one in workers]),
        (
            "esc_worker_unreadable_jobs",
            "Queued jobs that a worker cannot read since a newer version wrote them: they need a worker of that "
            "version.",
            [one.unreadable_jobs for one in workers],
        ),
    ):
        names = [[worker.name] for worker in workers]
        yield _gauges(name, meaning, ["worker"], zip(names, values, strict=True))
    model = InfoMetricFamily("esc_worker_model", "Network of a worker; empty: missing.", labels=["worker"])
    builds = InfoMetricFamily("esc_worker_build", "Version of a worker; empty: 0.1.0.", labels=["worker"])
    for worker in workers:
        model.add_metric([worker.name], {"sha256": worker.model_sha256 or ""})
        builds.add_metric([worker.name], {"version": worker.version or ""})
    yield from (model, builds)


def _gauge(name: str, meaning: str, value: float) -> Metric:
    return GaugeMetricFamily(name, meaning, value=value)


def _gauges(
    name: str, meaning: str, labels: Sequence[str], samples: Iterable[tuple[list[str], float | datetime | None]]
) -> Metric:
    """Return a gauge with a sample for each of several labels; an unknown value (None) makes none."""
    family = GaugeMetricFamily(name, meaning, labels=labels)
    for values, value in samples:
        if value is not None:
            family.add_metric(values, value.timestamp() if isinstance(value, datetime) else value)
    return family
