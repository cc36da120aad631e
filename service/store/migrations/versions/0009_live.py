"""What the processes that send live poses report of each venue."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"

moment = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Create both tables, empty; what their columns mean is said in `service.store.tables`."""
    op.create_table(
        "live_reports",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("reported_at", moment, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("watched", sa.JSON, nullable=False),
        sa.Column("alarm_due_at", moment),
    )
    op.create_index("live_reports_by_alarm", "live_reports", ["alarm_due_at"])
    op.create_table(
        "live_minutes",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("minute", moment, primary_key=True),
        sa.Column("cameras", sa.JSON, nullable=False),
    )
    op.create_index("live_minutes_by_minute", "live_minutes", ["minute"])
