"""The two homes of the service: a folder, and servers that are started for the tests from what the machine has."""

import atexit
import functools
import itertools
import os
import pwd
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import obstore
import psycopg
import pytest
from obstore.store import from_url

from service import queue
from service.store.database import connect, migrate
from testbed.parameters import try_first

STARTING_S = 60
BUCKET = "esc-tests"
# Nothing of a test's database must survive a power cut. What is committed survives a kill of its processes, though:
# `synchronous_commit=off` would lose that too.
HASTY = ("fsync=off", "full_page_writes=off")
# On a test: which home, or homes, it runs in. What it builds, it builds in the home that the fixture `home` gives.
in_both_homes = pytest.mark.parametrize("home", ["embedded", "servers"], indirect=True)
# For what no database, lock, clock or list decides: on servers it is tried by `make test-long` alone.
in_one_home_first = pytest.mark.parametrize("home", try_first(["embedded", "servers"]), indirect=True)
on_servers = pytest.mark.parametrize("home", ["servers"], indirect=True)


class Embedded:
    """SQLite and a folder, as without any setting."""

    def database_url(self, folder: Path) -> str:
        return f"sqlite:///{folder}/esc.sqlite"

    def make_database(self, folder: Path) -> None:
        """With the service's tables, in a hundredth of the time that migrations take; one that is there stays."""
        database = folder / "esc.sqlite"
        if not database.exists():
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(_migrated(), database)

    def give_back(self, folder: Path) -> None:
        """The file goes with the folder of its test."""

    def blob_url(self, folder: Path) -> str:
        return (folder / "blobs").as_uri()

    def settings(self, folder: Path) -> dict[str, str]:
        return {}

    @contextmanager
    def database_away(self, folder: Path) -> Iterator[None]:
        with closing(sqlite3.connect(folder / "esc.sqlite", timeout=30, isolation_level=None)) as database:
            database.execute("ALTER TABLE jobs RENAME TO away")
            try:
                yield
            finally:
                database.execute("ALTER TABLE away RENAME TO jobs")

    @contextmanager
    def database_locked(self, folder: Path) -> Iterator[None]:
        """Another process writes, and goes on and on."""
        with closing(sqlite3.connect(folder / "esc.sqlite", timeout=30, isolation_level=None)) as database:
            database.execute("BEGIN IMMEDIATE")
            try:
                yield
            finally:
                database.execute("ROLLBACK")


class Servers:
    """PostgreSQL and S3: a database and a part of the bucket for each folder that would be a home."""

    def __init__(self, postgres: "Postgres", bucket: "Bucket") -> None:
        self._postgres = postgres
        self._bucket = bucket
        self._names: dict[Path, str] = {}
        self._made = itertools.count()
        self._empty: list[str] = []

    def database_url(self, folder: Path) -> str:
        if folder not in self._names:
            self._create_database(folder)
        return self._postgres.url(self._names[folder])

    def make_database(self, folder: Path) -> None:
        """With the service's tables: an emptied one, or a copy of a migrated one; one that is there stays."""
        if folder in self._names:
            return
        if self._empty:
            self._names[folder] = self._empty.pop()
            return
        # Without fsync, files are copied faster than by the log.
        by_files = " STRATEGY FILE_COPY" if self._postgres.version >= 15 else ""
        self._create_database(folder, f" TEMPLATE {self._template}{by_files}")

    @functools.cached_property
    def _template(self) -> str:
        """The name of a migrated database, which nobody else connects to."""
        migrated = Path("migrated")
        _make_tables(self.database_url(migrated))
        return self._names[migrated]

    @functools.cached_property
    def _rows_of_migrations(self) -> dict[str, list[str]]:
        """The rows that migrations leave in each table."""
        with psycopg.connect(self._postgres.url(self._template)) as connection:
            return {table: _rows(connection, table) for table in _tables(connection)}

    def give_back(self, folder: Path) -> None:
        """Empty the database of a test for another test: to copy one costs eight times as much, and 8 MB of disk.

        One that a test has given other tables or another version is left as it is. Fixtures that share one give it
        back once.
        """
        name = self._names.pop(folder, None)
        if name is None:
            return
        with psycopg.connect(self._postgres.url(name), autocommit=True) as connection:
            if _tables(connection) != list(self._rows_of_migrations):
                return
            changed = [table for table, rows in self._rows_of_migrations.items() if _rows(connection, table) != rows]
            if any(self._rows_of_migrations[table] for table in changed):
                return
            if changed:
                connection.execute(f"TRUNCATE {', '.join(changed)} CASCADE")
            connection.execute("SELECT setval(format('%I.%I', schemaname, sequencename), 1, false) FROM pg_sequences")
        self._empty.append(name)

    def _create_database(self, folder: Path, how: str = "") -> None:
        self._names[folder] = f"home_{next(self._made)}"
        with psycopg.connect(self._postgres.url("postgres"), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {self._names[folder]}{how}")

    def blob_url(self, folder: Path) -> str:
        return f"{self._bucket.url}/{folder.relative_to(folder.anchor)}"

    def settings(self, folder: Path) -> dict[str, str]:
        return {"database_url": self.database_url(folder), "blob_url": self.blob_url(folder)}

    @contextmanager
    def database_away(self, folder: Path) -> Iterator[None]:
        self._postgres.stop()
        try:
            yield
        finally:
            self._postgres.start()

    @contextmanager
    def table_locked(self, folder: Path, table: str) -> Iterator[None]:
        """Another transaction has a table to itself, and goes on and on."""
        with psycopg.connect(self.database_url(folder)) as connection:
            connection.execute(f"LOCK TABLE {table} IN ACCESS EXCLUSIVE MODE")
            yield
            connection.rollback()

    def kill_database(self) -> None:
        """All its processes at once, as a crash would; it is started again."""
        self._postgres.stop(signal.SIGQUIT)
        self._postgres.start()

    @contextmanager
    def bucket_away(self) -> Iterator[None]:
        """It takes requests and does not answer them."""
        self._bucket.server.send_signal(signal.SIGSTOP)
        # Its threads go on until one of them has come to run and has seen the signal.
        os.waitid(os.P_PID, self._bucket.server.pid, os.WSTOPPED)
        try:
            yield
        finally:
            self._bucket.server.send_signal(signal.SIGCONT)


def _tables(connection: psycopg.Connection) -> list[str]:
    own = "schemaname NOT IN ('pg_catalog', 'information_schema')"
    named = f"SELECT format('%I.%I', schemaname, tablename) FROM pg_tables WHERE {own} ORDER BY 1"
    return [table for (table,) in connection.execute(named)]


def _rows(connection: psycopg.Connection, table: str) -> list[str]:
    return [row for (row,) in connection.execute(f"SELECT t::text FROM {table} t ORDER BY 1 LIMIT 10")]


Home = Embedded | Servers


def _make_tables(url: str) -> None:
    """Make the tables of the service and those of its queue, which would take as long again."""
    engine = connect(url)
    migrate(engine)
    engine.dispose()
    queue.migrate(url)


@functools.cache
def _migrated() -> Path:
    """A file that SQLite databases of tests begin as."""
    folder = Path(tempfile.mkdtemp(prefix="esc-migrated-"))
    atexit.register(shutil.rmtree, folder)
    _make_tables(f"sqlite:///{folder}/esc.sqlite")
    with closing(sqlite3.connect(folder / "esc.sqlite")) as migrated:
        # All of it into the one file.
        migrated.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return folder / "esc.sqlite"


def environment(settings: dict[str, str]) -> dict[str, str]:
    """Settings for another process."""
    return {f"ESC_{name.upper()}": value for name, value in settings.items()}


def files(blob_url: str, folder: str = "") -> list[str]:
    """The paths of everything that lies in a home."""
    return sorted(entry["path"] for page in obstore.list(from_url(blob_url), folder) for entry in page)


def postgres_binaries() -> Path | None:
    """Where `initdb` and `postgres` are: on the path, or where Debian keeps each version; the newest."""
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda folder: int(folder.parent.name))
    on_path = shutil.which("initdb")
    folders = [*debian, *([Path(on_path).resolve().parent] if on_path else [])]
    return next((folder for folder in reversed(folders) if (folder / "postgres").exists()), None)


class Postgres:
    """A server on a socket that only this user reaches."""

    def __init__(self, binaries: Path, options: Sequence[str]) -> None:
        # Not below pytest's folder: PostgreSQL refuses to run as root, and nobody else may look in there.
        self._folder = Path(tempfile.mkdtemp(prefix="esc-postgres-"))
        self._binaries, self._log, self._options = binaries, self._folder / "log", options
        self._as_somebody = {"cwd": self._folder, **_who_may_run_postgres(self._folder)}
        with self._log.open("ab") as log:
            subprocess.run(
                [
                    binaries / "initdb",
                    "-D",
                    "data",
                    "-U",
                    "esc",
                    "-E",
                    "UTF8",
                    "--locale=C",
                    "-A",
                    "trust",
                    "--no-sync",
                ],
                check=True,
                stdout=log,
                stderr=log,
                **self._as_somebody,
            )
        self.start()

    @property
    def version(self) -> int:
        """The major one."""
        with psycopg.connect(self.url("postgres")) as connection:
            return connection.info.server_version // 10_000

    def url(self, database: str) -> str:
        return f"postgresql://esc@/{database}?host={self._folder}"

    def log_statements_of(self, database: str) -> None:
        """Of every connection that is made to it from now on."""
        with psycopg.connect(self.url(database), autocommit=True) as connection:
            connection.execute(f"ALTER DATABASE {database} SET log_statement = 'all'")

    def transactions(self) -> int:
        """How many have ended of those whose statements are logged."""
        ends = ("statement: COMMIT", "statement: ROLLBACK")
        return sum(line.endswith(ends) for line in self._log.read_text(errors="replace").splitlines())

    def start(self) -> None:
        options = [word for option in ("listen_addresses=", *self._options) for word in ("-c", option)]
        command = [self._binaries / "postgres", "-D", "data", "-k", self._folder, *options]
        with self._log.open("ab") as log:
            self._server = subprocess.Popen(command, stdout=log, stderr=log, **self._as_somebody)
        end = time.monotonic() + STARTING_S
        while True:
            try:
                psycopg.connect(self.url("postgres")).close()
                return
            except psycopg.OperationalError:
                assert self._server.poll() is None, self._log.read_text()
                assert time.monotonic() < end, self._log.read_text()
                time.sleep(0.05)

    def stop(self, how: signal.Signals = signal.SIGINT) -> None:
        """At once: connections are closed and what was not committed is lost; by SIGQUIT without another word."""
        self._server.send_signal(how)
        self._server.wait(STARTING_S)

    def remove(self) -> None:
        # Without writing all databases out first.
        self.stop(signal.SIGQUIT)
        shutil.rmtree(self._folder)


@contextmanager
def postgres_server(binaries: Path, options: Sequence[str] = HASTY) -> Iterator[Postgres]:
    """A server of one's own."""
    server = Postgres(binaries, options)
    try:
        yield server
    finally:
        server.remove()


def _who_may_run_postgres(folder: Path) -> dict:
    """Whom to run it as: PostgreSQL refuses root. The folder becomes theirs."""
    if os.geteuid() != 0:
        return {}
    user = next(user for name in ("postgres", "nobody") for user in pwd.getpwall() if user.pw_name == name)
    os.chown(folder, user.pw_uid, user.pw_gid)
    return {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}


@dataclass(frozen=True)
class Bucket:
    """A bucket, and the process that serves it."""

    url: str
    server: subprocess.Popen


@contextmanager
def s3_server() -> Iterator[Bucket]:
    """A server in a process of its own, with a bucket; the environment says how to reach it."""
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        address = next(line.split()[-1] for line in server.stderr if "Running on" in line)
        # It says a line per request, which nobody reads.
        threading.Thread(target=server.stderr.read, daemon=True).start()
        # It imports its S3 when first asked, beside all processes of a run that begins.
        httpx.put(f"{address}/{BUCKET}", timeout=60).raise_for_status()
        with pytest.MonkeyPatch.context() as patch:
            for name, value in {
                "AWS_ENDPOINT_URL": address,
                "AWS_ALLOW_HTTP": "true",
                "AWS_ACCESS_KEY_ID": "key",
                "AWS_SECRET_ACCESS_KEY": "secret",
            }.items():
                patch.setenv(name, value)
            yield Bucket(f"s3://{BUCKET}", server)
    finally:
        server.kill()
        server.wait()
        server.stderr.close()
