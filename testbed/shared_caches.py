"""Make once what each service, client and test of a process would make anew: compiled SQL and trusted certificates.

SQLAlchemy keeps compiled statements with the engine, and each test has an engine of its own; httpx reads the
certificates of all authorities for each client, also of one that asks this machine.
"""

import functools
import ssl

import sqlalchemy as sa


def share_caches() -> None:
    """Let all engines and clients of this process share them, those that are made later as well."""
    ssl.create_default_context = functools.cache(ssl.create_default_context)
    statements = CompiledStatements()

    @sa.event.listens_for(sa.Engine, "engine_connect")
    def use(connection: sa.Connection) -> None:
        connection.execution_options(compiled_cache=statements)


class CompiledStatements(dict):
    """Compiled statements by their key, in which how a dialect compiles stands for the dialect."""

    def get(self, key, default=None):
        return super().get(_key_of_alike(key), default)

    def __setitem__(self, key, compiled):
        super().__setitem__(_key_of_alike(key), compiled)


def _key_of_alike(key):
    dialect, *of_statement = key
    return (dialect.name, dialect.statement_compiler, dialect._json_serializer, *of_statement)
