"""Metrics for Prometheus.

Each process counts the requests that it answers. Everything else is read from the database at each scrape, so that
every API process shows the same, and restarts of workers lose nothing.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar, get_args

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
from service.store.live import LiveGauges
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
from service.store.statistics.snapshot import StatisticsSnapshot, VenueGauges
from service.store.statistics.source_timings import FETCH, FRAME, NONE
from service.store.unreadable import RowKind, unreadable_rows
from service.store.venue_state import AnchorRow
from service.store.workers import WorkerHeartbeat

# Name, help and value of gauges; an unknown value (None) makes no sample.
OF_VENUES: tuple[tuple[str, str, Callable[[VenueGauges], float | None]], ...] = (
    (
        "esc_venue_stitch_error_pixels",
        "Stitch error of the current poses, by the last result; 1 px is 10 cm.",
        lambda venue: venue.stitch_error_px,
    ),
    ("esc_venue_moved_pixels", "Largest movement of a camera in the last result.", lambda venue: venue.moved_px),
    ("esc_venue_drift_pixels", "Largest movement of a camera since its pose was set.", lambda venue: venue.drift_px),
    (
        "esc_venue_accepted_timestamp_seconds",
        "Time at which poses were last accepted.",
        lambda venue: None if venue.accepted_at is None else venue.accepted_at.timestamp(),
    ),
)
OF_CAMERAS: tuple[tuple[str, str, Callable[[AnchorRow], float | None]], ...] = (
    (
        "esc_camera_trend_meters",
        "Distance of the camera's moving average from its baseline, at the far touchline.",
        lambda camera: camera.moved_m,
    ),
    (
        "esc_camera_trend_cusum",
        "Largest cumulative sum of the camera's control charts, in standard deviations; above 5 it has moved.",
        lambda camera: camera.cusum,
    ),
    (
        "esc_camera_trend_beyond",
        "1 while a control chart of the camera, EWMA or CUSUM, is beyond its limit.",
        lambda camera: float(camera.beyond),
    ),
)
OF_LIVE_POSES: tuple[tuple[str, str, Callable[[LiveGauges], float | None]], ...] = (
    (
        "esc_live_running",
        "1 while the process that sends the venue's live poses reports; absent after a day without reports.",
        lambda live: float(live.running),
    ),
    (
        "esc_live_measured_ratio",
        "Share of the tracked cameras' pictures in which lines were measured, over the last one to two minutes.",
        lambda live: live.measured_share,
    ),
    (
        "esc_live_latency_p99_seconds",
        "Latency from the arrival of a picture to the sending of its pose, of the slowest camera over ten seconds.",
        lambda live: live.latency_p99_s,
    ),
)
OF_A_VENUE: Mapping[str, Callable[[Any], str]] = {"venue": lambda figures: figures.venue}
Figures = TypeVar("Figures", VenueGauges, AnchorRow, LiveGauges)
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
        yield from _unreadable()
        try:
            figures = self._read()
        except DATABASE_OUTAGES:
            log.warning("no figures for Prometheus", exc_info=True)
            yield _gauge("esc_database_up", "1 if the database answers.", 0)
            return
        yield _gauge("esc_database_up", "1 if the database answers.", 1)
        yield from _queue(figures)
        yield from _jobs(figures.counters)
        yield from _schedules(figures)
        # The worst of each, as many as the setting `metrics_venues` allows.
        yield from _gauges(OF_VENUES, figures.venues, OF_A_VENUE)
        yield from _gauges(OF_CAMERAS, figures.trends, {**OF_A_VENUE, "camera": lambda trend: trend.camera})
        yield from _gauges(OF_LIVE_POSES, figures.live, OF_A_VENUE)
        yield from _alarms(figures)
        yield from _workers(figures.workers, self._silence_s)
        yield from _callbacks(figures)

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


def _unreadable() -> Iterator[Metric]:
    rows = GaugeMetricFamily(
        "esc_unreadable_rows",
        "Stored rows that this process could not read within the last hour; its log names them.",
        labels=["kind"],
    )
    counts = unreadable_rows()
    for kind in get_args(RowKind):
        rows.add_metric([kind], counts[kind])
    yield rows


def _queue(figures: StatisticsSnapshot) -> Iterator[Metric]:
    jobs = GaugeMetricFamily("esc_queue_jobs", "Jobs in the queue.", labels=["priority"])
    oldest = GaugeMetricFamily("esc_queue_oldest_age_seconds", "Age of the oldest queued job.", labels=["priority"])
    for name, number in PRIORITIES.items():
        waiting = figures.queue.get(number)
        jobs.add_metric([name], waiting.jobs if waiting else 0)
        oldest.add_metric([name], waiting.oldest_s if waiting else 0)
    yield jobs
    yield oldest
    yield _gauge("esc_jobs_running", "Running jobs.", figures.running)


def _jobs(counters: Mapping[CounterKey, float]) -> Iterator[Metric]:
    ended = CounterMetricFamily("esc_jobs_ended", "Calibrations by their end.", labels=["status", "verdict", "error"])
    for outcome in OUTCOMES:
        ended.add_metric(outcome, counters.get((ENDED, outcome), 0))
    yield ended
    others = CounterMetricFamily(
        "esc_other_jobs_ended", "Jobs of other kinds than calibrations by their end.", labels=["kind", "status"]
    )
    for other in OTHER_OUTCOMES:
        others.add_metric(other, counters.get((OTHERS_ENDED, other), 0))
    yield others
    views = CounterMetricFamily(
        "esc_views", "Cameras in calibrations by their frames: usable, or why not.", labels=["condition"]
    )
    for condition in VIEW_CONDITIONS:
        views.add_metric([condition], counters.get((VIEWS, (condition,)), 0))
    yield views
    restarts = counters.get((RESTARTS, ()), 0)
    yield CounterMetricFamily(
        "esc_job_restarts", "Attempts after a job's first one, whose worker died or was stopped.", value=restarts
    )
    yield _histogram("esc_job_wait_seconds", "Time from submission to start of calibrations.", WAIT, counters)
    yield _histogram("esc_job_duration_seconds", "Time from start to end of calibrations.", DURATION, counters)
    stages = HistogramMetricFamily(
        "esc_job_stage_duration_seconds", "Durations of stages of jobs with a result.", labels=["stage"]
    )
    for stage in STAGES:
        stages.add_metric([stage], *STAGE.read(counters, stage))
    yield stages
    yield _histogram(
        "esc_job_stitch_error_pixels", "Stitch errors of found poses; 1 px is 10 cm.", STITCH_ERROR, counters
    )


def _schedules(figures: StatisticsSnapshot) -> Iterator[Metric]:
    late = GaugeMetricFamily(
        "esc_schedule_late_seconds",
        "Delay of the schedule that has been due for longest, by the answers of its cameras the last time.",
        labels=["cameras"],
    )
    for cameras, seconds in zip(("answered", "slow-or-silent"), figures.schedules_late_s, strict=True):
        late.add_metric([cameras], seconds)
    yield late
    fetches = HistogramMetricFamily(
        "esc_source_fetch_seconds", "Durations of fetches from sources of cameras, by outcome.", labels=["outcome"]
    )
    for outcome in (FRAME, NONE):
        fetches.add_metric([outcome], *FETCH.read(figures.counters, outcome))
    yield fetches


def _gauges(
    families: Sequence[tuple[str, str, Callable[[Figures], float | None]]],
    figures: Sequence[Figures],
    labels: Mapping[str, Callable[[Figures], str]],
) -> Iterator[Metric]:
    """Yield the gauges of venues or cameras, without samples for unknown values."""
    for name, meaning, figure in families:
        family = GaugeMetricFamily(name, meaning, labels=list(labels))
        for one in figures:
            value = figure(one)
            if value is not None:
                family.add_metric([label(one) for label in labels.values()], value)
        yield family


def _alarms(figures: StatisticsSnapshot) -> Iterator[Metric]:
    active = GaugeMetricFamily("esc_alarms", "Active alarms of venues and cameras.", labels=["rule"])
    begun = CounterMetricFamily("esc_alarms_begun", "Alarms that began.", labels=["rule"])
    for rule in get_args(AlarmRule):
        active.add_metric([rule], figures.alarms.get(rule, 0))
        begun.add_metric([rule], figures.counters.get((BEGUN, (rule,)), 0))
    of_venues = GaugeMetricFamily("esc_venue_alarm", "1 for an active alarm, oldest first.", labels=["venue", "rule"])
    for alarm in figures.ringing:
        of_venues.add_metric([alarm.venue, alarm.rule], 1)
    yield from (active, begun, of_venues)


def _workers(workers: list[WorkerHeartbeat], silence_s: float) -> Iterator[Metric]:
    alive = [worker for worker in workers if worker.is_alive(silence_s)]
    yield _gauge("esc_workers", "Workers with a recent heartbeat.", len(alive))
    up = GaugeMetricFamily("esc_worker_up", "1 for a worker with a recent heartbeat.", labels=["worker"])
    age = GaugeMetricFamily("esc_worker_heartbeat_age_seconds", "Time since its last heartbeat.", labels=["worker"])
    model = InfoMetricFamily("esc_worker_model", "Network of a worker; empty: missing.", labels=["worker"])
    builds = InfoMetricFamily("esc_worker_build", "Version of a worker; empty: 0.1.0.", labels=["worker"])
    unreadable = GaugeMetricFamily(
        "esc_worker_unreadable_jobs",
        "Queued jobs that a worker cannot read since a newer version wrote them: they need a worker of that version.",
        labels=["worker"],
    )
    for worker in workers:
        up.add_metric([worker.name], float(worker in alive))
        if worker.silent_s is not None:
            age.add_metric([worker.name], worker.silent_s)
        model.add_metric([worker.name], {"sha256": worker.model_sha256 or ""})
        builds.add_metric([worker.name], {"version": worker.version or ""})
        unreadable.add_metric([worker.name], worker.unreadable_jobs)
    yield from (up, age, model, builds, unreadable)


def _callbacks(figures: StatisticsSnapshot) -> Iterator[Metric]:
    yield _gauge("esc_callbacks_waiting", "Callbacks that are due or will be retried.", figures.callbacks_waiting)
    finished = CounterMetricFamily("esc_callbacks", "Callbacks that will not be retried.", labels=["outcome"])
    for outcome in ("delivered", "given-up", "expired"):
        finished.add_metric([outcome], figures.counters.get((CALLBACKS, (outcome,)), 0))
    yield finished


def _gauge(name: str, meaning: str, value: float) -> Metric:
    return GaugeMetricFamily(name, meaning, value=value)


def _histogram(name: str, meaning: str, buckets: HistogramBuckets, counters: Mapping[CounterKey, float]) -> Metric:
    cumulative, total = buckets.read(counters)
    return HistogramMetricFamily(name, meaning, buckets=cumulative, sum_value=total)
