"""Alembic's entry: runs inside the transaction that `service.store.engine.migrate` opened."""

from alembic import context

from service.store.engine import SCHEMA_TABLE

context.configure(
    connection=context.config.attributes["connection"], transactional_ddl=False, version_table=SCHEMA_TABLE
)
context.run_migrations()
