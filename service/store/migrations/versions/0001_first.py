"""Venues, their poses, jobs and workers."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Create the tables of the first release."""
    moment = sa.DateTime(timezone=True)
    op.create_table(
        "venues",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("updated_at", moment, nullable=False),
    )
    op.create_table(
        "pose_history",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
        sa.Column("camera", sa.String(64), nullable=False),
        sa.Column("pose", sa.JSON, nullable=False),
        sa.Column("cause", sa.String(32), nullable=False),
        sa.Column("job", sa.String(26)),
        sa.Column("since", moment, nullable=False),
    )
    op.create_index("ix_pose_history_venue", "pose_history", ["venue"])
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(26), primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
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
        sa.Column("error", sa.JSON),
        sa.Column("created_at", moment, nullable=False),
        sa.Column("started_at", moment),
        sa.Column("finished_at", moment),
        sa.Column("updated_at", moment, nullable=False),
    )
    op.create_index("jobs_by_venue", "jobs", ["venue", "id"])
    op.create_index("jobs_by_status", "jobs", ["status", "priority", "id"])
    op.create_index("one_job_per_key", "jobs", ["venue", "idempotency_key"], unique=True)
    active = sa.text("status IN ('queued', 'running')")
    op.create_index(
        "one_active_job_per_venue", "jobs", ["venue"], unique=True, sqlite_where=active, postgresql_where=active
    )
    op.create_table(
        "workers",
        sa.Column("name", sa.String(255), primary_key=True),
        sa.Column("model_sha256", sa.String(64)),
        sa.Column("started_at", moment, nullable=False),
        sa.Column("seen_at", moment, nullable=False),
    )
