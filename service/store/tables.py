"""The tables, and what their columns mean. Those of an earlier version become these by `migrations`."""

from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa


class Instant(sa.TypeDecorator[datetime]):
    """A moment in UTC. SQLite keeps no time zone, so it is put back when read."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> datetime | None:  # noqa: ARG002
        """Let every moment leave with its zone."""
        return None if value is None else value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


def _actor_columns() -> list[sa.Column[Any]]:
    """Return the columns of the actor of a change, see actors.py; null: the service by itself."""
    return [
        sa.Column(name, sa.String(length)) for name, length in (("asked_by", 80), ("address", 64), ("request_id", 64))
    ]


def _partial_index(name: str, column: str, where: sa.TextClause, *, unique: bool = False) -> sa.Index:
    return sa.Index(name, column, unique=unique, sqlite_where=where, postgresql_where=where)


metadata = sa.MetaData()

venues = sa.Table(
    "venues",
    metadata,
    sa.Column("id", sa.String(64), primary_key=True),
    # schemas.venue.Venue, with the poses that hold now.
    sa.Column("document", sa.JSON, nullable=False),
    sa.Column("updated_at", Instant, nullable=False),
)

# Every state that the cameras of a venue were ever in, and what brought it.
revisions = sa.Table(
    "revisions",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("venue", sa.String(64), nullable=False),
    # Counts from 1 in each venue.
    sa.Column("number", sa.Integer, nullable=False),
    sa.Column("at", Instant, nullable=False),
    # schemas.history.Cause.
    sa.Column("cause", sa.String(16), nullable=False),
    # The job that found the poses; of a restored revision, the job whose poses were rejected by hand.
    sa.Column("job", sa.String(26)),
    sa.Column("restored_from", sa.Integer),
    sa.Column("stitch_error_px", sa.Double),
    # schemas.geometry.PosedCamera of each, and the ridge that their poses belong to.
    sa.Column("cameras", sa.JSON, nullable=False),
    sa.Column("ridge", sa.JSON, nullable=False),
    # schemas.history.NumberChange by the name of a number of the field that was adopted or put back; null: none was.
    sa.Column("field_numbers", sa.JSON(none_as_null=True)),
    # schemas.geometry.Movement by camera.
    sa.Column("movements", sa.JSON, nullable=False),
    *_actor_columns(),
    sa.Index("revisions_by_venue", "venue", "number", unique=True),
    sa.Index("revisions_by_job", "job"),
    sa.Index("revisions_by_time", "cause", "at"),
)

# Memories of a venue's cameras: measurements of earlier nights, see memories.py.
memories = sa.Table(
    "memories",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    # The number of the revision that it came with.
    sa.Column("revision", sa.Integer, primary_key=True, autoincrement=False),
    # By camera what `CameraMemory.to_json` of the engine wrote.
    sa.Column("document", sa.JSON, nullable=False),
)

# Condition of a queued or running calibration; a query with these very words can use the index with this condition.
ACTIVE = sa.text("status IN ('queued', 'running') AND kind = 'calibration'")

jobs = sa.Table(
    "jobs",
    metadata,
    sa.Column("id", sa.String(26), primary_key=True),
    # schemas.job.Kind.
    sa.Column("kind", sa.String(16), nullable=False, server_default="calibration"),
    # Null: the photos of a lens belong to no venue.
    sa.Column("venue", sa.String(64)),
    sa.Column("status", sa.String(16), nullable=False),
    sa.Column("priority", sa.Integer, nullable=False),
    # The request: schemas.options.Options, FieldOptions or FindOptions (the seed filled in), IntrinsicsOptions or
    # LocateOptions.
    sa.Column("options", sa.JSON, nullable=False),
    # Hash of the frames and options as they were sent: the same content is the same job.
    sa.Column("content_hash", sa.String(64), nullable=False),
    sa.Column("idempotency_key", sa.String(255)),
    # The venue as it was when the frames were checked against it; JSON's null where there is none.
    sa.Column("venue_document", sa.JSON, nullable=False),
    # schemas.find.SoughtSite: a venue that is not stored yet, whose cameras are to be found.
    sa.Column("site", sa.JSON(none_as_null=True)),
    # Camera id (of photos: their names) to the paths of its frames in the blob store.
    sa.Column("frames", sa.JSON, nullable=False),
    sa.Column("attempt", sa.Integer, nullable=False, default=0),
    # Fencing token of the attempt that may write: a worker that lost its job finds another token here and stops.
    sa.Column("run_token", sa.String(32)),
    # Counts every change of the row, so that waiters need to read nothing else.
    sa.Column("revision", sa.Integer, nullable=False, default=1),
    sa.Column("progress", sa.JSON(none_as_null=True)),
    sa.Column("result", sa.JSON(none_as_null=True)),
    # Names of the pictures that were made: not every pose can be drawn.
    sa.Column("pictures", sa.JSON(none_as_null=True)),
    sa.Column("error", sa.JSON(none_as_null=True)),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("started_at", Instant),
    sa.Column("finished_at", Instant),
    sa.Column("updated_at", Instant, nullable=False),
    # From then on the row answers for none of its files, whether or not the store is rid of them.
    sa.Column("frames_deleted_at", Instant),
    sa.Column("pictures_deleted_at", Instant),
    *_actor_columns(),
    # The place of its request in a trace.
    sa.Column("traceparent", sa.String(55)),
    # The lists, newest first, by whatever they are filtered; of one venue, filtered within the index.
    sa.Index("jobs_by_venue", "venue", "id", "status", "kind"),
    sa.Index("jobs_of_status", "status", "id"),
    sa.Index("jobs_of_kind", "kind", "id"),
    sa.Index("jobs_of_kind_and_status", "kind", "status", "id"),
    # The queue.
    sa.Index("jobs_by_status", "status", "priority", "id"),
    sa.Index("one_job_per_key", "venue", "idempotency_key", unique=True),
    _partial_index("one_active_job_per_venue", "venue", ACTIVE, unique=True),
    sa.Index("jobs_by_end", "finished_at"),
    _partial_index("jobs_with_frames", "finished_at", sa.text("frames_deleted_at IS NULL")),
    _partial_index("jobs_with_pictures", "finished_at", sa.text("pictures_deleted_at IS NULL")),
)

# For queries about the jobs of one venue: SQLite, which has no statistics, would as soon go through all of a kind.
BY_VENUE = (jobs, "INDEXED BY jobs_by_venue", "sqlite")

# Folders of the blob store that are deleted at `due_at`: what no row names any more, and an upload until it is a job.
leftovers = sa.Table(
    "leftovers",
    metadata,
    sa.Column("folder", sa.String(255), primary_key=True),
    sa.Column("due_at", Instant, nullable=False),
    sa.Index("leftovers_by_due", "due_at"),
)

# The event log: what happened to venues, in the order of each one's transactions, until it expires.
events = sa.Table(
    "events",
    metadata,
    # Never given twice, also after the last one was deleted: clients go on from it.
    sa.Column("id", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True),
    sa.Column("venue", sa.String(64), nullable=False),
    # The `type` of schemas.events.venue_event.Event.
    sa.Column("type", sa.String(32), nullable=False),
    sa.Column("at", Instant, nullable=False),
    # Its data; of a job that ended, which is read when it is told, null.
    sa.Column("data", sa.JSON(none_as_null=True)),
    sa.Column("job", sa.String(26)),
    *_actor_columns(),
    sa.Index("events_by_venue", "venue", "id"),
    sqlite_autoincrement=True,
)

# The outbox: deliveries, written with their events, attempted until they succeed or are given up.
deliveries = sa.Table(
    "deliveries",
    metadata,
    # The id of the job that has ended, or of the delivery alone.
    sa.Column("id", sa.String(26), primary_key=True),
    sa.Column("url", sa.String(2048), nullable=False),
    # The host of the URL.
    sa.Column("receiver", sa.String(255), nullable=False),
    # `waiting`, then `delivered` or `given-up`.
    sa.Column("status", sa.String(16), nullable=False),
    sa.Column("attempts", sa.Integer, nullable=False, default=0),
    # The time of the next attempt.
    sa.Column("due_at", Instant, nullable=False),
    # Why the last attempt that failed did.
    sa.Column("last_error", sa.String(500)),
    # Which of `events`; null: that the job has ended.
    sa.Column("event", sa.BigInteger),
    sa.Index("deliveries_by_due", "status", "due_at"),
)

# Counts that outlive processes, see statistics/counters.py.
tallies = sa.Table(
    "tallies",
    metadata,
    sa.Column("metric", sa.String(64), primary_key=True),
    # Their values, separated by commas.
    sa.Column("labels", sa.String(255), primary_key=True),
    sa.Column("value", sa.Double, nullable=False),
)

# Quality of each venue by its last results, see statistics/venue_quality.py.
venue_quality = sa.Table(
    "venue_quality",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    # Of the poses in use since the last result: of the new ones if they were accepted, or else of those before.
    sa.Column("stitch_error_px", sa.Double),
    # How far the picture of the pitch was found to have moved, at the camera that moved most.
    sa.Column("moved_px", sa.Double),
    # The time at which the poses in use were accepted; null: they were put.
    sa.Column("accepted_at", Instant),
    # Drift of the camera that is furthest from where it was put.
    sa.Column("drift_px", sa.Double),
    # Calibrations since then that brought no pose for any camera; dry runs do not count.
    sa.Column("rejected_in_a_row", sa.Integer, nullable=False, server_default="0"),
    # statistics.venue_quality.CameraHistory by camera.
    sa.Column("cameras", sa.JSON(none_as_null=True)),
    # statistics.venue_quality.CalibrationSummary; null: it was never calibrated.
    sa.Column("glance", sa.JSON(none_as_null=True)),
    # The next time at which an alarm begins unless something happens before.
    sa.Column("alarm_due_at", Instant),
    sa.Index("venues_by_stitch_error", "stitch_error_px"),
    sa.Index("venues_by_alarm", "alarm_due_at"),
)

# From where the movement of each camera is counted: the newest of a camera counts, those before it are there to go back
# to. One begins with whatever says where a camera is: a PUT that changed it, a result that was accepted by hand.
camera_anchors = sa.Table(
    "camera_anchors",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    sa.Column("camera", sa.String(64), primary_key=True),
    # The revision of the venue in which that happened.
    sa.Column("revision", sa.Integer, primary_key=True, autoincrement=False),
    # The time of the first accepted pose since then, and that schemas.geometry.PosedCamera; null: none was yet.
    sa.Column("at", Instant),
    sa.Column("posed", sa.JSON(none_as_null=True)),
    # By quantity: control_charts.Baseline, once it is settled.
    sa.Column("baselines", sa.JSON, nullable=False),
    # The charts after the last night, see schemas.trend.Trend: whether a mean has moved, by how much at the
    # far touchline (null: of an anchor that counts no more, too), the largest cumulative sum, and all of it in words.
    sa.Column("beyond", sa.Boolean, nullable=False),
    sa.Column("moved_m", sa.Double),
    sa.Column("cusum", sa.Double),
    sa.Column("words", sa.String(500), nullable=False),
    sa.Index("camera_anchors_by_move", "moved_m"),
)

# Displacement of each camera from its anchor in each accepted job: schemas.trend.Displacement, and the pose's sigma.
camera_trend = sa.Table(
    "camera_trend",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("venue", sa.String(64), nullable=False),
    sa.Column("camera", sa.String(64), nullable=False),
    # Which of camera_anchors, and the revision that the pose became.
    sa.Column("anchor", sa.Integer, nullable=False),
    sa.Column("revision", sa.Integer, nullable=False),
    sa.Column("job", sa.String(26), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("across_m", sa.Double, nullable=False),
    sa.Column("away_m", sa.Double, nullable=False),
    sa.Column("sigma_across_m", sa.Double, nullable=False),
    sa.Column("sigma_away_m", sa.Double, nullable=False),
    sa.Column("repeatability_across_m", sa.Double, nullable=False),
    sa.Column("repeatability_away_m", sa.Double, nullable=False),
    sa.Column("rotation_deg", sa.Double, nullable=False),
    sa.Column("sigma_rotation_deg", sa.Double),
    sa.Column("position_m", sa.Double, nullable=False),
    sa.Column("sigma_position_m", sa.Double),
    sa.Column("focal_length", sa.Double),
    sa.Column("sigma_focal_length", sa.Double),
    sa.Column("focal_length_m", sa.Double, nullable=False),
    sa.Index("camera_trend_by_camera", "venue", "camera", "id"),
)

# Active alarms.
alarms = sa.Table(
    "alarms",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    # schemas.health.AlarmRule.
    sa.Column("rule", sa.String(32), primary_key=True),
    # Empty: of the whole venue.
    sa.Column("camera", sa.String(64), primary_key=True),
    sa.Column("since", Instant, nullable=False),
    sa.Column("why", sa.String(500), nullable=False),
    sa.Index("alarms_by_since", "since"),
)

# Schedules of venues, and their next times.
schedules = sa.Table(
    "schedules",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    sa.Column("cron", sa.String(100), nullable=False),
    sa.Column("time_zone", sa.String(64), nullable=False),
    sa.Column("exact", sa.Boolean, nullable=False),
    # The time it is fired for, and when somebody is to look at it: later while a worker is at it.
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("look_at", Instant, nullable=False),
    sa.Column("last_at", Instant),
    sa.Column("last_job", sa.String(26)),
    sa.Column("last_error", sa.String(500)),
    # While a worker is at it: until when nobody else is. Null: nobody is.
    sa.Column("claimed_until", Instant),
    # Fetches in a row without a frame, and whether the last one with frames took long: see schedules.py, lanes.
    sa.Column("failures", sa.Integer, nullable=False, server_default="0"),
    sa.Column("slow", sa.Boolean, nullable=False, server_default=sa.false()),
    sa.Index("schedules_by_look", "look_at"),
)

# The newest report of the process that sends a venue's live poses, see live.py.
live_reports = sa.Table(
    "live_reports",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    # The time of arrival.
    sa.Column("reported_at", Instant, nullable=False),
    # schemas.live.LiveState without what the service adds.
    sa.Column("document", sa.JSON, nullable=False),
    # By tracked camera live_alarms.WatchedCamera: since when it is not as it should be.
    sa.Column("watched", sa.JSON, nullable=False),
    # The next time at which an alarm of live poses may begin or end; null: never, unless another report comes.
    sa.Column("alarm_due_at", Instant),
    sa.Index("live_reports_by_alarm", "alarm_due_at"),
)

# The reports of a venue, folded by the minute.
live_minutes = sa.Table(
    "live_minutes",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    # The beginning of the minute.
    sa.Column("minute", Instant, primary_key=True),
    # schemas.live.LiveMinuteCamera by camera.
    sa.Column("cameras", sa.JSON, nullable=False),
    sa.Index("live_minutes_by_minute", "minute"),
)

# User and password of the sources of cameras, as they stand in a URL: the venue itself is shown to who may read.
credentials = sa.Table(
    "credentials",
    metadata,
    sa.Column("venue", sa.String(64), primary_key=True),
    sa.Column("camera", sa.String(64), primary_key=True),
    sa.Column("userinfo", sa.String(1024), nullable=False),
)

# The heartbeat of the workers.
workers = sa.Table(
    "workers",
    metadata,
    sa.Column("name", sa.String(255), primary_key=True),
    # Hash of the model file that the worker computes with; null: the file is missing.
    sa.Column("model_sha256", sa.String(64)),
    # The version of the program.
    sa.Column("version", sa.String(64)),
    # Jobs that wait and that it cannot read, because a newer version wrote them.
    sa.Column("unreadable_jobs", sa.Integer),
    sa.Column("started_at", Instant, nullable=False),
    sa.Column("seen_at", Instant, nullable=False),
    # One for each start, by which two workers of one name are told apart.
    sa.Column("token", sa.String(32)),
    # The folder and the start of the machine where only one worker of a name can run, hashed; null: it has ended.
    sa.Column("place", sa.String(64)),
)

api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("name", sa.String(64), primary_key=True),
    # SHA-256 of the key, which itself is nowhere.
    sa.Column("hash", sa.String(64), nullable=False),
    # schemas.base.Scope.
    sa.Column("scope", sa.String(16), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    # Null: never.
    sa.Column("expires_at", Instant),
    # To the minute; null: not yet.
    sa.Column("last_used_at", Instant),
    # The ids of the venues that it is for; null: all.
    sa.Column("venues", sa.JSON(none_as_null=True)),
    sa.Index("api_keys_by_hash", "hash", unique=True),
)

# Browser sessions; one ends with its key as well.
sessions = sa.Table(
    "sessions",
    metadata,
    # SHA-256 of what is in the cookie.
    sa.Column("hash", sa.String(64), primary_key=True),
    # Hash of the key that it began with.
    sa.Column("key_hash", sa.String(64), nullable=False),
    sa.Column("expires_at", Instant, nullable=False),
)
