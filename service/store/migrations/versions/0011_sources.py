"""User and password of the sources of cameras, beside the venue, which is shown."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"


def upgrade() -> None:
    """Make room for them."""
    op.create_table(
        "credentials",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("camera", sa.String(64), primary_key=True),
        sa.Column("userinfo", sa.String(1024), nullable=False),
    )
