"""Venues that are not stored yet, beside the jobs that look for their cameras."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Add the column, empty: no job has looked for cameras before."""
    op.add_column("jobs", sa.Column("site", sa.JSON))
