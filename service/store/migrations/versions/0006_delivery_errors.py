"""Why the last attempt of a delivery failed."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Make room for it; of attempts before, nobody knows."""
    op.add_column("deliveries", sa.Column("last_error", sa.String(500)))
