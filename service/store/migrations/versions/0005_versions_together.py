"""Room beside the documents for what 0.1.0 does not know, and what version each worker is."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Add columns that processes of 0.1.0, which may still run, neither read nor need to write."""
    op.add_column("venues", sa.Column("additions", sa.JSON))
    op.add_column("jobs", sa.Column("venue_additions", sa.JSON))
    op.add_column("jobs", sa.Column("result_additions", sa.JSON))
    op.add_column("workers", sa.Column("version", sa.String(64)))
    op.add_column("workers", sa.Column("unreadable_jobs", sa.Integer))
