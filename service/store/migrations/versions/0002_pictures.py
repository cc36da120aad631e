"""Which pictures a job made. A venue's tag is of its content now: a count began anew when a venue was created again."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Remember the pictures, forget the counts."""
    op.add_column("jobs", sa.Column("pictures", sa.JSON))
    op.drop_column("venues", "revision")
