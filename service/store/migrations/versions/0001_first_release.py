"""The tables of the first release."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

moment = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Create them; what their columns mean is said in `service.store.tables`."""
    _venues()
    _jobs()
    _beside_venues()
    _beside_jobs()
    _of_the_service()


def _venues() -> None:
    op.create_table(
        "venues",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("updated_at", moment, nullable=False),
    )
    op.create_table(
        "revisions",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("at", moment, nullable=False),
        sa.Column("cause", sa.String(16), nullable=False),
        sa.Column("job", sa.String(26)),
        sa.Column("restored_from", sa.Integer),
        sa.Column("stitch_error_px", sa.Double),
        sa.Column("cameras", sa.JSON, nullable=False),
        sa.Column("ridge", sa.JSON, nullable=False),
        sa.Column("movements", sa.JSON, nullable=False),
    )
    op.create_index("revisions_by_venue", "revisions", ["venue", "number"], unique=True)
    op.create_index("revisions_by_job", "revisions", ["job"])
    op.create_index("revisions_by_time", "revisions", ["cause", "at"])


def _jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(26), primary_key=True),
        sa.Column("kind", sa.String(16), nullable=False, server_default="calibration"),
        sa.Column("venue", sa.String(64)),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("priority", sa.Integer, nullable=False),
        sa.Column("options", sa.JSON, nullable=False),
        sa.Column("content_hash", sa.String(64), nullable=False),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("venue_document", sa.JSON, nullable=False),
        sa.Column("frames", sa.JSON, nullable=False),
        sa.Column("attempt", sa.Integer, nullable=False),
        sa.Column("run_token", sa.String(32)),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("progress", sa.JSON),
        sa.Column("result", sa.JSON),
        sa.Column("pictures", sa.JSON),
        sa.Column("error", sa.JSON),
        sa.Column("created_at", moment, nullable=False),
        sa.Column("started_at", moment),
        sa.Column("finished_at", moment),
        sa.Column("updated_at", moment, nullable=False),
        sa.Column("frames_deleted_at", moment),
        sa.Column("pictures_deleted_at", moment),
        sa.Column("asked_by", sa.String(80)),
        sa.Column("request_id", sa.String(64)),
        sa.Column("traceparent", sa.String(55)),
    )
    op.create_index("jobs_by_venue", "jobs", ["venue", "id", "status", "kind"])
    op.create_index("jobs_of_status", "jobs", ["status", "id"])
    op.create_index("jobs_of_kind", "jobs", ["kind", "id"])
    op.create_index("jobs_of_kind_and_status", "jobs", ["kind", "status", "id"])
    op.create_index("jobs_by_status", "jobs", ["status", "priority", "id"])
    op.create_index("jobs_by_end", "jobs", ["finished_at"])
    op.create_index("one_job_per_key", "jobs", ["venue", "idempotency_key"], unique=True)
    active = "status IN ('queued', 'running') AND kind = 'calibration'"
    _partial_index("one_active_job_per_venue", "venue", active, unique=True)
    _partial_index("jobs_with_frames", "finished_at", "frames_deleted_at IS NULL")
    _partial_index("jobs_with_pictures", "finished_at", "pictures_deleted_at IS NULL")


def _partial_index(name: str, column: str, condition: str, *, unique: bool = False) -> None:
    where = sa.text(condition)
    op.create_index(name, "jobs", [column], unique=unique, sqlite_where=where, postgresql_where=where)


def _beside_venues() -> None:
    op.create_table(
        "venue_quality",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("stitch_error_px", sa.Double),
        sa.Column("moved_px", sa.Double),
        sa.Column("accepted_at", moment),
        sa.Column("drift_px", sa.Double),
        sa.Column("rejected_in_a_row", sa.Integer, nullable=False, server_default="0"),
        sa.Column("cameras", sa.JSON(none_as_null=True)),
        sa.Column("glance", sa.JSON(none_as_null=True)),
        sa.Column("alarm_due_at", moment),
    )
    op.create_index("venues_by_stitch_error", "venue_quality", ["stitch_error_px"])
    op.create_index("venues_by_alarm", "venue_quality", ["alarm_due_at"])
    op.create_table(
        "alarms",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("rule", sa.String(32), primary_key=True),
        sa.Column("camera", sa.String(64), primary_key=True),
        sa.Column("since", moment, nullable=False),
        sa.Column("why", sa.String(500), nullable=False),
    )
    op.create_index("alarms_by_since", "alarms", ["since"])
    op.create_table(
        "schedules",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("cron", sa.String(100), nullable=False),
        sa.Column("time_zone", sa.String(64), nullable=False),
        sa.Column("exact", sa.Boolean, nullable=False),
        sa.Column("due_at", moment, nullable=False),
        sa.Column("look_at", moment, nullable=False),
        sa.Column("last_at", moment),
        sa.Column("last_job", sa.String(26)),
        sa.Column("last_error", sa.String(500)),
    )
    op.create_index("schedules_by_look", "schedules", ["look_at"])
    op.create_table(
        "credentials",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("camera", sa.String(64), primary_key=True),
        sa.Column("userinfo", sa.String(1024), nullable=False),
    )


def _beside_jobs() -> None:
    op.create_table(
        "leftovers",
        sa.Column("folder", sa.String(255), primary_key=True),
        sa.Column("due_at", moment, nullable=False),
    )
    op.create_index("leftovers_by_due", "leftovers", ["due_at"])
    op.create_table(
        "events",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
        sa.Column("type", sa.String(32), nullable=False),
        sa.Column("at", moment, nullable=False),
        sa.Column("data", sa.JSON),
        sa.Column("job", sa.String(26)),
        sqlite_autoincrement=True,
    )
    op.create_index("events_by_venue", "events", ["venue", "id"])
    op.create_table(
        "deliveries",
        sa.Column("id", sa.String(26), primary_key=True),
        sa.Column("url", sa.String(2048), nullable=False),
        sa.Column("receiver", sa.String(255), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("due_at", moment, nullable=False),
        sa.Column("last_error", sa.String(500)),
        sa.Column("event", sa.BigInteger),
    )
    op.create_index("deliveries_by_due", "deliveries", ["status", "due_at"])
    op.create_table(
        "tallies",
        sa.Column("metric", sa.String(64), primary_key=True),
        sa.Column("labels", sa.String(255), primary_key=True),
        sa.Column("value", sa.Double, nullable=False),
    )


def _of_the_service() -> None:
    op.create_table(
        "workers",
        sa.Column("name", sa.String(255), primary_key=True),
        sa.Column("model_sha256", sa.String(64)),
        sa.Column("started_at", moment, nullable=False),
        sa.Column("seen_at", moment, nullable=False),
    )
    op.create_table(
        "api_keys",
        sa.Column("name", sa.String(64), primary_key=True),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("scope", sa.String(16), nullable=False),
        sa.Column("created_at", moment, nullable=False),
        sa.Column("expires_at", moment),
        sa.Column("last_used_at", moment),
    )
    op.create_index("api_keys_by_hash", "api_keys", ["hash"], unique=True)
    op.create_table(
        "sessions",
        sa.Column("hash", sa.String(64), primary_key=True),
        sa.Column("key_hash", sa.String(64), nullable=False),
        sa.Column("expires_at", moment, nullable=False),
    )
