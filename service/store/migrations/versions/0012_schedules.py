"""Schedules of venues: when each fires next, and what came of the last time."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    """Make room for them."""
    moment = sa.DateTime(timezone=True)
    op.create_table(
        "schedules",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("cron", sa.String(100), nullable=False),
        sa.Column("time_zone", sa.String(64), nullable=False),
        sa.Column("due_at", moment, nullable=False),
        sa.Column("look_at", moment, nullable=False),
        sa.Column("last_job", sa.String(26)),
        sa.Column("last_error", sa.String(500)),
    )
    op.create_index("schedules_by_look", "schedules", ["look_at"])
