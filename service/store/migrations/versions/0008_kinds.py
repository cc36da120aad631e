"""Jobs of other kinds than calibrations: some belong to no venue, and a venue may have any number of them."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
# Conditions of partial indexes are not kept when SQLite rebuilds a table: they are made again.
PARTIAL = {
    "jobs_with_frames": ("finished_at", "frames_deleted_at IS NULL"),
    "jobs_with_pictures": ("finished_at", "pictures_deleted_at IS NULL"),
}
ACTIVE = sa.text("status IN ('queued', 'running') AND kind = 'calibration'")


def upgrade() -> None:
    """Let every job say what it computes, and be of no venue."""
    for name in ("one_active_job_per_venue", *PARTIAL):
        op.drop_index(name, "jobs")
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("kind", sa.String(16), nullable=False, server_default="calibration"))
        jobs.alter_column("venue", existing_type=sa.String(64), nullable=True)
    op.create_index(
        "one_active_job_per_venue", "jobs", ["venue"], unique=True, sqlite_where=ACTIVE, postgresql_where=ACTIVE
    )
    for name, (column, condition) in PARTIAL.items():
        where = sa.text(condition)
        op.create_index(name, "jobs", [column], sqlite_where=where, postgresql_where=where)
