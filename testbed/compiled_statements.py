"""Share compiled SQL among the engines of a process: each test has one of its own, and all run the same statements.

SQLAlchemy keeps what it compiled with the engine, so that each test and each service would compile everything anew: a
tenth of a second and more. Dialects that compile alike share one cache here.
"""

import sqlalchemy as sa


class CompiledStatements(dict):
    """Compiled statements by their key, in which how a dialect compiles stands for the dialect."""

    def get(self, key, default=None):
        return super().get(_key_of_alike(key), default)

    def __setitem__(self, key, compiled):
        super().__setitem__(_key_of_alike(key), compiled)


def _key_of_alike(key):
    dialect, *of_statement = key
    return (dialect.name, dialect.statement_compiler, dialect._json_serializer, *of_statement)


def share_compiled_statements() -> None:
    """Let all engines of this process use one cache, those that it makes later as well."""
    statements = CompiledStatements()

    @sa.event.listens_for(sa.Engine, "engine_connect")
    def use(connection: sa.Connection) -> None:
        connection.execution_options(compiled_cache=statements)
