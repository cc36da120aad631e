"""The schema of release 0.2.0, the oldest that is brought up to date; `service.store.database` refuses older ones."""

revision = "0009"
down_revision = None


def upgrade() -> None:
    """Do nothing: an empty database gets the tables of today at once, see `service.store.database.upgrade`."""
