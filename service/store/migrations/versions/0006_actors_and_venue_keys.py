"""Who made each change and from where, and the venues that a key is for."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the columns, empty: of what happened before nobody knows who did it, and older keys are for all venues."""
    for table in ("revisions", "events"):
        op.add_column(table, sa.Column("asked_by", sa.String(80)))
        op.add_column(table, sa.Column("address", sa.String(64)))
        op.add_column(table, sa.Column("request_id", sa.String(64)))
    op.add_column("jobs", sa.Column("address", sa.String(64)))
    op.add_column("api_keys", sa.Column("venues", sa.JSON))
