"""The database: one engine, transactions for reading and for writing, and the schema brought up to date."""

import json
import select
import sqlite3
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy.dialects.sqlite.base import SQLiteCompiler

from service.store import tables
from service.store.file_systems import network_file_system

MIGRATIONS = Path(__file__).parent / "migrations"
# Which schema a database has.
SCHEMA_TABLE = "esc_schema"
WRITES = "esc_writes"
# Options by which a reading transaction sees one state; every transaction of SQLite does.
SNAPSHOT: dict[str, dict[str, Any]] = {"sqlite": {}, "postgresql": {"isolation_level": "REPEATABLE READ"}}
# Errors while the database is away, locked or moving to another machine: trying again later can help.
DATABASE_OUTAGES = (sa.exc.OperationalError, sa.exc.InterfaceError, sa.exc.InternalError, sa.exc.TimeoutError)
# By their code, errors of PostgreSQL that gave a statement up.
GIVEN_UP = {
    "57014": "Its database took too long for an answer and was interrupted.",
    "55P03": "What the request needs is locked in its database by another transaction.",
}
# Any number, the same everywhere: of the locks by which writers wait for each other on PostgreSQL.
LOCK = 0x45_53_43
# The wait for a connection while all of them are busy. There are fewer connections than threads.
POOL_TIMEOUT_S = 5.0
# Server settings of each connection. What a machine held that vanished in the middle of a transaction is free again
# within a minute. One locked table must not hold every thread that answers: statements have limits, below which all of
# ours stay by far. Schema changes and retention have their own.
SESSION = "-c idle_in_transaction_session_timeout=60s"
LIMITS = "-c statement_timeout=15s -c lock_timeout=5s"
UNLIMITED, LONGEST = "esc_unlimited", "10min"
# Defaults for libpq, which the URL overrides: a server that is out of reach is given up after seconds.
PATIENCE = {
    "connect_timeout": "5",
    "keepalives_idle": "10",
    "keepalives_interval": "5",
    "keepalives_count": "3",
    "tcp_user_timeout": "30000",
}


def _parse_json(text: str) -> Any:
    """Return the value of a column, or its text where that is no JSON: a row must not break the query that meets it."""
    try:
        return json.loads(text)
    except ValueError:
        return text


# The connection of `snapshot`, for what is read inside it.
_snapshot: ContextVar[sa.Connection | None] = ContextVar("snapshot", default=None)
# NaN is none: SQLite would store what neither its own functions nor other programs can read.
JSON: dict[str, Any] = {"json_serializer": partial(json.dumps, allow_nan=False), "json_deserializer": _parse_json}


class UnsupportedDatabase(Exception):  # noqa: N818
    """Raised where this program or machine cannot use the database; the message says what to do."""


def sqlite_file(url: str) -> Path | None:
    """Return the file of an SQLite database, or None for PostgreSQL."""
    parsed = sa.make_url(url)
    return Path(parsed.database or "") if parsed.get_backend_name() == "sqlite" else None


def require_local_file(url: str) -> None:
    """Raise `UnsupportedDatabase` if SQLite would lie on a file system of a network."""
    file = sqlite_file(url)
    kind = None if file is None else network_file_system(file)
    if kind is not None:
        raise UnsupportedDatabase(
            f"The database {file} is SQLite on a network file system ({kind}), which damages it sooner or later. Use "
            "PostgreSQL (ESC_DATABASE_URL), or a disk of this machine (ESC_DATA). If API and worker run on this one "
            "machine and the file system keeps locks, ESC_SQLITE_ON_NETWORK=true starts it all the same."
        )


def connect(url: str) -> sa.Engine:
    """Return an engine on SQLite in WAL mode or on PostgreSQL."""
    file = sqlite_file(url)
    if file is None:
        return postgresql(url)
    if sys.version_info >= (3, 12) and sqlite3.sqlite_version_info < (3, 42):
        raise UnsupportedDatabase(
            f"Python {sys.version_info.major}.{sys.version_info.minor} here has SQLite {sqlite3.sqlite_version}; "
            "the job queue needs 3.42 with it. Use Python 3.11, a Python with a newer SQLite, or PostgreSQL."
        )
    file.parent.mkdir(parents=True, exist_ok=True)
    engine = sa.create_engine(url, pool_timeout=POOL_TIMEOUT_S, **JSON)
    engine.dialect.statement_compiler = _Hinting
    sa.event.listen(engine, "connect", _set_up_sqlite)
    sa.event.listen(engine, "begin", _begin_sqlite)
    return engine


class _Hinting(SQLiteCompiler):
    """SQLite has hints (INDEXED BY), which SQLAlchemy takes and leaves out."""

    def get_from_hint_text(self, table: sa.FromClause, text: str | None) -> str | None:  # noqa: ARG002
        """Return the hint that follows the name of a table."""
        return text


def postgresql(url: str, limits: str = LIMITS) -> sa.Engine:
    """Return an engine on PostgreSQL. `options` in the URL count before ours: `?options=-c%20statement_timeout%3D60s`.

    Connections are not tried before each use, which would double the transactions. One that a server closed as it ended
    is made anew; one whose server vanished fails at its first use (`DATABASE_OUTAGES`), and then all of them are made
    anew.
    """
    parsed = sa.make_url(url)
    given = parsed.query.get("options", ())
    options = [SESSION, limits, *([given] if isinstance(given, str) else given)]
    query = PATIENCE | parsed.query | {"options": " ".join(options)}
    target = parsed.set(drivername="postgresql+psycopg", query=query)
    engine = sa.create_engine(target, pool_timeout=POOL_TIMEOUT_S, **JSON)
    sa.event.listen(engine, "begin", _lift_limits)
    sa.event.listen(engine, "checkout", _require_open)
    return engine


def without_timeouts(engine: sa.Engine) -> sa.Engine:
    """Return an engine with the same connections, for background transactions whose statements may take minutes."""
    return engine.execution_options(**{UNLIMITED: True})


def _require_open(connection: Any, _record: object, _fairy: object) -> None:
    """Have connections replaced that their server has closed: on one that waits, nothing else arrives."""
    arrived = select.poll()
    arrived.register(connection.fileno(), select.POLLIN)
    if arrived.poll(0):
        raise sa.exc.InvalidatePoolError


def _lift_limits(connection: sa.Connection) -> None:
    if connection.get_execution_options().get(UNLIMITED, False):
        limits = [sa.func.set_config(name, LONGEST, True) for name in ("statement_timeout", "lock_timeout")]
        connection.execute(sa.select(*limits))


def outage_reason(error: Exception) -> str:
    """Return in words for a client why one of `DATABASE_OUTAGES` was raised."""
    if isinstance(error, sa.exc.TimeoutError):
        return "All connections to its database are busy."
    state = getattr(getattr(error, "orig", None), "sqlstate", None)
    return GIVEN_UP.get(str(state), "Its storage does not answer.")


def share_sqlite(connection: sqlite3.Connection) -> None:
    """Set up a connection to a SQLite file that other processes write to: in WAL mode, where locks are waited for."""
    longest_s = 30
    connection.execute(f"PRAGMA busy_timeout={1000 * longest_s}")
    until = time.monotonic() + longest_s
    while not _enters_wal_mode(connection, until):
        time.sleep(0.01)
    connection.execute("PRAGMA foreign_keys=ON")


def _enters_wal_mode(connection: sqlite3.Connection, until: float) -> bool:
    """Enter WAL mode; False where SQLite refuses that at once, whatever its timeout: a new file that is written to."""
    try:
        connection.execute("PRAGMA journal_mode=WAL")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:
            raise
        return False
    return True


def _set_up_sqlite(connection: sqlite3.Connection, _: object) -> None:
    # Transactions are begun by hand below: the driver would begin one only at the first write.
    connection.isolation_level = None
    share_sqlite(connection)
    connection.execute("PRAGMA synchronous=FULL")


def _begin_sqlite(connection: sa.Connection) -> None:
    # A transaction that reads first and writes later fails at once when another writer was faster, whatever the
    # busy timeout: writers take the lock at their beginning.
    writes = connection.get_execution_options().get(WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextmanager
def reading(engine: sa.Engine) -> Iterator[sa.Connection]:
    """A transaction that sees one state of the database and takes no lock; inside `snapshot` it is that one."""
    shared = _snapshot.get()
    if shared is not None and shared.engine is engine:
        yield shared
        return
    with engine.connect().execution_options(**SNAPSHOT[engine.dialect.name]) as connection, connection.begin():
        yield connection


@contextmanager
def snapshot(engine: sa.Engine) -> Iterator[None]:
    """Let every `reading` of this engine in the block share one transaction, and so see the same state."""
    with reading(engine) as connection:
        token = _snapshot.set(connection)
        try:
            yield
        finally:
            _snapshot.reset(token)


@contextmanager
def writing(engine: sa.Engine) -> Iterator[sa.Connection]:
    """Open a transaction that locks the database (SQLite) or the rows that it writes (PostgreSQL)."""
    with engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
        yield connection


def advisory_lock(connection: sa.Connection, about: str) -> None:
    """Wait until no other transaction that called this about the same is open; on SQLite a writer is alone anyway.

    Each wait costs whoever comes next, so take it about as little and as late as what you read allows.
    """
    if connection.dialect.name == "postgresql":
        connection.execute(sa.select(sa.func.pg_advisory_xact_lock(LOCK, sa.func.hashtext(about))))


def lock_venue(connection: sa.Connection, venue_id: str) -> None:
    """Wait until no other transaction that changes a venue, or relies on it, is open."""
    advisory_lock(connection, f"venue {venue_id}")


def clock(connection: sa.Connection) -> datetime:
    """Return the time of the clock that all processes share: that of PostgreSQL, or of the machine with SQLite."""
    if connection.dialect.name == "postgresql":
        now: datetime = connection.execute(sa.select(sa.func.clock_timestamp())).scalar_one()
        return now
    return datetime.now(UTC)


class Repository:
    """Base of the classes that hold all SQL about one subject."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def now(self) -> datetime:
        """Return the time of the database, see `clock`."""
        with reading(self._engine) as connection:
            return clock(connection)


def migrate(engine: sa.Engine) -> None:
    """Bring the schema up to date; of several processes that start together one does it.

    Raises `UnsupportedDatabase` for a database of a newer version, of one before 0.2.0, or of another program.
    """
    with writing(without_timeouts(engine)) as connection:
        advisory_lock(connection, "schema")
        upgrade(connection)


def upgrade(connection: sa.Connection) -> None:
    """Bring the schema up to date, inside the caller's transaction that is serialised about it.

    An empty database gets the tables of today; those of an earlier version become them by migrations.
    """
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.attributes["connection"] = connection
    found = schema_of(connection)
    _require_supported_schema(connection, found)
    if found is None:
        tables.metadata.create_all(connection, checkfirst=False)
        command.stamp(config, "head")
    else:
        command.upgrade(config, "head")


def schema_of(connection: sa.Connection) -> str | None:
    """Return the schema that a database has, or None if it has none of a service."""
    return MigrationContext.configure(connection, opts={"version_table": SCHEMA_TABLE}).get_current_revision()


def newest_schema() -> str | None:
    """Return the schema of this program."""
    return ScriptDirectory(str(MIGRATIONS)).get_current_head()


def _require_supported_schema(connection: sa.Connection, found: str | None) -> None:
    known = [script.revision for script in ScriptDirectory(str(MIGRATIONS)).walk_revisions()]
    newest, oldest = known[0], known[-1]
    program = f"ESC {version('esc-calibration')}"
    foreign = tables.metadata.tables.keys() & {*sa.inspect(connection).get_table_names()} if found is None else ()
    if foreign or (found is not None and found < oldest):
        made_by = f"schema {found}" if found else f"no schema number, but tables such as {min(foreign)}"
        raise UnsupportedDatabase(
            f"This database has {made_by}: a version before 0.2.0, or another program, made it. {program} takes an "
            f"empty database or one of ESC 0.2.0 or later (schema {oldest} to {newest}). Set ESC_DATA, or "
            "ESC_DATABASE_URL, to a new place and PUT the venues there as the old version gives them (GET /venues)."
        )
    if found not in (None, *known):
        raise UnsupportedDatabase(
            f"This database has schema {found}, and {program} knows none after {newest}: a newer version has been at "
            "it. Start that version again, or restore the backup from before the upgrade; there is no way back."
        )
