"""Alarms of venues: what they go by, those that ring, and their deliveries beside those of jobs."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
moment = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Make room for them."""
    op.add_column("venue_quality", sa.Column("drift_px", sa.Double))
    op.add_column("venue_quality", sa.Column("rejected_in_a_row", sa.Integer, nullable=False, server_default="0"))
    op.add_column("venue_quality", sa.Column("alarm_due_at", moment))
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
    with op.batch_alter_table("deliveries") as deliveries:
        deliveries.alter_column("job", new_column_name="id", existing_type=sa.String(26), existing_nullable=False)
        deliveries.add_column(sa.Column("event", sa.JSON))
