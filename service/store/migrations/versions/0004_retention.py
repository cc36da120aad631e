"""Which files of a job were deleted, and the folders that are still to be."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Let retention find what is past its time without reading every job."""
    moment = sa.DateTime(timezone=True)
    op.add_column("jobs", sa.Column("frames_deleted_at", moment))
    op.add_column("jobs", sa.Column("pictures_deleted_at", moment))
    op.create_index("jobs_by_end", "jobs", ["finished_at"])
    for files in ("frames", "pictures"):
        kept = sa.text(f"{files}_deleted_at IS NULL")
        op.create_index(f"jobs_with_{files}", "jobs", ["finished_at"], sqlite_where=kept, postgresql_where=kept)
    op.create_table(
        "leftovers",
        sa.Column("folder", sa.String(255), primary_key=True),
        sa.Column("due_at", moment, nullable=False),
    )
    op.create_index("leftovers_by_due", "leftovers", ["due_at"])
