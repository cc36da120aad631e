"""Alembic's entry: runs inside the transaction that `service.store.database.migrate` opened."""

from alembic import context

from service.store.database import SCHEMA_TABLE

context.configure(
    connection=context.config.attributes["connection"], transactional_ddl=False, version_table=SCHEMA_TABLE
)
context.run_migrations()
