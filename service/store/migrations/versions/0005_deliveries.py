"""Who is to be told of the end of a job, and whether that was done."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Make room for deliveries."""
    op.create_table(
        "deliveries",
        sa.Column("job", sa.String(26), primary_key=True),
        sa.Column("url", sa.String(2048), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("due_at", sa.DateTime(timezone=True), nullable=False),
    )
    op.create_index("deliveries_by_due", "deliveries", ["status", "due_at"])
