"""What is counted and measured for whoever watches, and which request a job came with."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Make room for it."""
    op.add_column("jobs", sa.Column("request_id", sa.String(64)))
    op.add_column("jobs", sa.Column("traceparent", sa.String(55)))
    op.create_table(
        "tallies",
        sa.Column("metric", sa.String(64), primary_key=True),
        sa.Column("labels", sa.String(255), primary_key=True),
        sa.Column("value", sa.Double, nullable=False),
    )
    op.create_table(
        "venue_quality",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("stitch_error_px", sa.Double),
        sa.Column("moved_px", sa.Double),
        sa.Column("accepted_at", sa.DateTime(timezone=True)),
    )
    op.create_index("venues_by_stitch_error", "venue_quality", ["stitch_error_px"])
