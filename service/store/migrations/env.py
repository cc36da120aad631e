"""Alembic's entry: runs inside the transaction that `service.store.engine.migrate` opened."""

from alembic import context

context.configure(connection=context.config.attributes["connection"], transactional_ddl=False)
context.run_migrations()
