"""Copying the database of a service into another one, SQLite or PostgreSQL: all of it, or nothing.

What the tables are is read from their metadata, so that a table that is added is copied as well. Of the queue's own
tables nothing is copied: jobs that are still open are put into the queue of the copy.
"""

import sqlite3
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

from service.schemas.names import OPEN_STATUSES
from service.store import tables
from service.store.database import (
    SNAPSHOT,
    advisory_lock,
    connect,
    newest_schema,
    schema_of,
    sqlite_file,
    upgrade,
    writing,
)
from service.store.jobs.attempts import Enqueue

ROWS_AT_ONCE = 500
# A process with the database file open locks it, so that even an idle service is noticed.
LOCKED_AFTER_MS = 2000
j = tables.jobs.c


class CannotCopy(Exception):  # noqa: N818
    """The one database cannot be copied into the other; the message says what to do."""


@contextmanager
def exclusive_snapshot(url: str) -> Iterator[sa.Connection]:
    """Open a transaction on one state of a database that no other process uses or changes meanwhile.

    Raises `CannotCopy` if somebody uses it, or it has another schema than this program.
    """
    engine = _exclusive(url) if sqlite_file(url) else connect(url)
    try:
        known_tables = _tables_in(engine) if engine.dialect.name == "postgresql" else []
        with engine.connect().execution_options(**SNAPSHOT[engine.dialect.name]) as connection, connection.begin():
            if engine.dialect.name == "postgresql":
                _require_to_be_alone(connection, known_tables)
            found, known = schema_of(connection), newest_schema()
            if found != known:
                raise CannotCopy(
                    f"The source has schema {found or 'none'}, and this program {known}: start the service of this "
                    "version on it once, which brings it up to date, and stop it again."
                )
            yield connection
    finally:
        engine.dispose()


def require_empty(connection: sa.Connection) -> None:
    """Raise `CannotCopy` unless a database has nothing of a service in it, at most its empty tables."""
    there = {*sa.inspect(connection).get_table_names()}
    counts = counts_of(connection, {name for name in tables.metadata.tables if name in there})
    filled = [f"{name} ({count})" for name, count in counts.items() if count]
    if filled:
        raise CannotCopy(
            f"The target is not empty, a service has been there: {', '.join(filled)}. Name a new database or folder."
        )
    found, known = schema_of(connection), newest_schema()
    if found not in (None, known):
        raise CannotCopy(f"The target has schema {found}, and this program {known}: name a new database or folder.")


def copy_rows(
    source: sa.Connection, target: sa.Engine, enqueue: Enqueue, committing: Callable[[], None]
) -> dict[str, int]:
    """Copy every row into an empty database and put open jobs into its queue, in one transaction.

    Gives how many rows each table has, which was counted in both. `committing` is called when only the commit is left,
    of which nobody knows what became if it is broken off.
    """
    with writing(target) as connection:
        advisory_lock(connection, "schema")
        _hold_on(connection)
        require_empty(connection)
        upgrade(connection)
        for table in tables.metadata.sorted_tables:
            _copy_table(source, connection, table)
        still_open = sa.select(j.id, j.priority, j.kind).where(j.status.in_(OPEN_STATUSES)).order_by(j.id)
        for job in source.execute(still_open).all():
            enqueue(connection, job.id, job.priority, job.kind)
        names = tables.metadata.tables.keys()
        there, here = counts_of(source, names), counts_of(connection, names)
        if there != here:
            wrong = [f"{name}: {there[name]} and {here[name]}" for name in there if there[name] != here[name]]
            raise CannotCopy(f"Source and copy have not the same number of rows, {'; '.join(wrong)}.")
        committing()
        return here


def counts_of(connection: sa.Connection, names: Collection[str]) -> dict[str, int]:
    """Return the number of rows of each table."""
    count = sa.func.count()
    return {
        name: connection.execute(sa.select(count).select_from(tables.metadata.tables[name])).scalar_one()
        for name in sorted(names)
    }


def _copy_table(source: sa.Connection, target: sa.Connection, table: sa.Table) -> None:
    query = sa.select(table).order_by(*table.primary_key)
    with source.execution_options(yield_per=ROWS_AT_ONCE).execute(query) as rows:
        for some in rows.mappings().partitions():
            target.execute(sa.insert(table), [dict(row) for row in some])
    column = table.autoincrement_column
    if column is not None:
        _go_on_after(target, table, column, _last_number(source, table, column))


def _last_number(connection: sa.Connection, table: sa.Table, column: sa.Column[int]) -> int:
    """Return the last number that a table has assigned, even to a deleted row: clients continue from event numbers."""
    highest = connection.scalar(sa.select(sa.func.max(column))) or 0
    if connection.dialect.name == "postgresql":
        last = sa.text("SELECT pg_sequence_last_value(pg_get_serial_sequence(:table, :column)::regclass)")
        given = connection.scalar(last, {"table": table.name, "column": column.name})
    elif table.dialect_options["sqlite"]["autoincrement"]:
        given = connection.scalar(sa.text("SELECT seq FROM sqlite_sequence WHERE name = :table"), {"table": table.name})
    else:
        given = None
    return max(highest, given or 0)


def _go_on_after(connection: sa.Connection, table: sa.Table, column: sa.Column[int], number: int) -> None:
    """Have a table assign the number after this one next."""
    if not number:
        return
    named = {"table": table.name, "number": number}
    if connection.dialect.name == "postgresql":
        sequence = sa.text("SELECT setval(pg_get_serial_sequence(:table, :column), :number)")
        connection.execute(sequence, {**named, "column": column.name})
    elif table.dialect_options["sqlite"]["autoincrement"]:
        connection.execute(sa.text("DELETE FROM sqlite_sequence WHERE name = :table"), {"table": table.name})
        connection.execute(sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES (:table, :number)"), named)


def _exclusive(url: str) -> sa.Engine:
    """Return an engine on SQLite whose first transaction fails while another process has the file open."""
    file = Path(sa.make_url(url).database or "")
    if not file.exists():
        raise CannotCopy(f"There is no service's database at {file}.")
    engine = sa.create_engine(url, poolclass=sa.pool.NullPool)

    @sa.event.listens_for(engine, "connect")
    def _(connection: sqlite3.Connection, _: object) -> None:
        connection.isolation_level = None
        connection.execute(f"PRAGMA busy_timeout={LOCKED_AFTER_MS}")
        connection.execute("PRAGMA locking_mode=EXCLUSIVE")

    @sa.event.listens_for(engine, "begin")
    def _(connection: sa.Connection) -> None:
        try:
            connection.exec_driver_sql("BEGIN EXCLUSIVE")
        except sa.exc.OperationalError as error:
            raise _in_use(f"another process has {file} open ({error.orig})") from None

    return engine


def _tables_in(engine: sa.Engine) -> list[str]:
    with engine.connect() as connection:
        return [name for name in sa.inspect(connection).get_table_names() if name in tables.metadata.tables]


def _require_to_be_alone(connection: sa.Connection, known_tables: Sequence[str]) -> None:
    """Raise `CannotCopy` if anybody else is connected to a PostgreSQL database; who comes now waits with writing."""
    _hold_on(connection)
    if known_tables:
        # Before the first query, which is what the transaction's one state of the database comes from.
        connection.exec_driver_sql(f"LOCK TABLE {', '.join(known_tables)} IN SHARE MODE")
    others = sa.text(
        "SELECT coalesce(nullif(application_name, ''), 'a client') || coalesce(' from ' || host(client_addr), '') "
        "FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid() "
        "AND backend_type = 'client backend'"
    )
    connected = sorted({*connection.scalars(others)})
    if connected:
        raise _in_use(f"others are connected to its database: {', '.join(connected)}")


def _hold_on(connection: sa.Connection) -> None:
    """Let a transaction be idle for as long as files are copied, and a statement take as long as a table is large."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("SET LOCAL idle_in_transaction_session_timeout = 0")
        connection.exec_driver_sql("SET LOCAL statement_timeout = 0")


def _in_use(why: str) -> CannotCopy:
    return CannotCopy(f"The source is in use, {why}. Stop API and workers, and what else has it open, and try again.")
