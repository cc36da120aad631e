"""Numbers of the field that were adopted with revisions, so that undoing one gives them back."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Add the column, empty: no number of a field was adopted before."""
    op.add_column("revisions", sa.Column("field_numbers", sa.JSON))
