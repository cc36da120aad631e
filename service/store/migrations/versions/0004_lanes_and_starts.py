"""What a schedule's last fetch was like and who is at it; which start of a worker its row is of."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the columns; what they mean is said in `service.store.tables`. A worker of 0.1.0 leaves its own empty."""
    op.add_column("schedules", sa.Column("claimed_until", sa.DateTime(timezone=True)))
    op.add_column("schedules", sa.Column("failures", sa.Integer, nullable=False, server_default="0"))
    op.add_column("schedules", sa.Column("slow", sa.Boolean, nullable=False, server_default=sa.false()))
    op.add_column("workers", sa.Column("token", sa.String(32)))
    op.add_column("workers", sa.Column("place", sa.String(64)))
