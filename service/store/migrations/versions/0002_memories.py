"""The memories of cameras, beside the revisions of their venues."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Create their table, empty: the next job of each venue begins its memories."""
    op.create_table(
        "memories",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("revision", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("document", sa.JSON, nullable=False),
    )
