"""A whole home in another database: between a folder and servers, through the command."""

import os
import signal
import sys
from datetime import UTC, datetime
from subprocess import PIPE, Popen

import pytest
import sqlalchemy as sa

from service.store import tables
from service.store.database import connect, migrate, writing
from testbed.homes import Embedded, environment, files
from testbed.parameters import try_first
from testbed.running import Service, wait_for
from tests.e2e.commands import esc_here, esc_process

GETS = (
    "/venues",
    "/venues/v",
    "/venues/v/history",
    "/venues/v/health",
    "/venues/v/cameras/left/trend",
    "/venues/v/poses?format=opencv",
    "/venues/cron",
    "/venues/cron/health",
    "/jobs",
    "/jobs?venue=v&status=succeeded",
)
NOON = datetime(2026, 11, 21, 12, 0, 0, 123456, tzinfo=UTC)
# What a column of each type is given.
VALUES = {sa.Integer: 7, sa.Double: 0.1 + 0.2, sa.Boolean: True, tables.Instant: NOON, sa.JSON: {"a": [0.1, None, "ä"]}}


@pytest.fixture
def esc(tmp_path):
    def esc(*arguments, **environment):
        plain = {name: value for name, value in os.environ.items() if not name.startswith("ESC_")}
        return esc_here(tmp_path, *arguments, **plain | environment)

    return esc


def place(home, folder):
    """What the command is told of a home: its folder, or the URL of its database, and the store of its files."""
    return str(folder) if isinstance(home, Embedded) else home.database_url(folder)


def every_row(url):
    """What each table has, by the metadata of the program."""
    engine = connect(url)
    with engine.connect() as connection:
        rows = {
            name: [tuple(row) for row in connection.execute(sa.select(table).order_by(*table.primary_key))]
            for name, table in tables.metadata.tables.items()
        }
    engine.dispose()
    return rows


def a_row_in_every_table(url):
    """A home in which no table is empty, with a value in every column."""
    engine = connect(url)
    migrate(engine)
    with writing(engine) as connection:
        for table in tables.metadata.sorted_tables:
            connection.execute(sa.insert(table).values({column.name: value_of(column) for column in table.columns}))
    engine.dispose()


def value_of(column):
    if column.name == "status":
        return "succeeded"
    if isinstance(column.type, sa.String):
        return f"{column.name} ä"[: column.type.length]
    return next(value for kind, value in VALUES.items() if isinstance(column.type, kind))


@pytest.mark.parametrize("way", ["to servers", "from servers"])
def test_every_row_of_every_table_is_the_same_in_the_copy(servers, esc, tmp_path, way):
    homes = (Embedded(), servers) if way == "to servers" else (servers, Embedded())
    here, there = ((home, tmp_path / name) for home, name in zip(homes, ("here", "there"), strict=True))
    a_row_in_every_table(here[0].database_url(here[1]))
    before = every_row(here[0].database_url(here[1]))
    assert all(before.values()), [name for name, rows in before.items() if not rows]
    run = esc("home", "copy", place(*here), place(*there), ESC_DATA=str(tmp_path / "data"))
    assert run.returncode == 0, run.stderr
    assert every_row(there[0].database_url(there[1])) == before
    counts = dict(line.split("\t") for line in run.stdout.splitlines())
    assert counts == dict.fromkeys(tables.metadata.tables, "1") | {"files": counts["files"]}
    # The next number comes after those that were copied.
    assert next_number(there[0].database_url(there[1])) == 8


def next_number(url):
    engine = connect(url)
    with writing(engine) as connection:
        row = sa.insert(tables.revisions).values(
            venue="n", number=1, at=sa.func.now(), cause="put", cameras=[], ridge=None, movements={}
        )
        number = connection.execute(row.returning(tables.revisions.c.id)).scalar_one()
    engine.dispose()
    return number


def test_numbers_of_events_are_not_given_again_in_the_copy(servers, esc, tmp_path):
    here = Embedded().database_url(tmp_path / "here")
    a_row_in_every_table(here)
    engine = connect(here)
    event = {"venue": "v", "type": "venue.created", "at": sa.func.now(), "data": None}
    with writing(engine) as connection:
        connection.execute(sa.insert(tables.events).values(id=100, **event))
    with writing(engine) as connection:
        connection.execute(sa.delete(tables.events))
    engine.dispose()
    there = servers.database_url(tmp_path / "there")
    assert esc("home", "copy", str(tmp_path / "here"), there, ESC_DATA=str(tmp_path / "data")).returncode == 0
    engine = connect(there)
    with writing(engine) as connection:
        assert (
            connection.execute(sa.insert(tables.events).values(event).returning(tables.events.c.id)).scalar_one() == 101
        )
    engine.dispose()


@pytest.mark.long
def test_a_service_on_the_copy_answers_as_the_one_before_and_goes_on(servers, start, esc, tmp_path):
    folder = tmp_path / "esc"
    folder.mkdir()
    # By a process of its own, which lets the database go.
    key = esc_process(tmp_path, "key", "add", "ops", "--scope", "admin", ESC_DATA=str(folder)).stdout.strip()
    bearer = {"Authorization": f"Bearer {key}"}

    def started(*arguments, **settings):
        service = start(*arguments, ESC_SOURCES='["127.0.0.1"]', **settings)
        service.http.headers.update(bearer)
        return service

    service = started("up").ready()
    for name in ("v", "cron"):
        service.venue(name)
    headers = {"Content-Type": "application/merge-patch+json"}
    source = {"source": "http://user:secret@127.0.0.1:9/a.jpg"}
    scheduled = {"schedule": {"cron": "0 3 * * *"}, "cameras": {"left": source, "right": source}}
    service.http.patch("/venues/cron", json=scheduled, headers=headers).raise_for_status()
    service.calibrated("v")
    job = service.calibrated("v", 1)
    assert service.stop() == 0
    # The API alone: what is submitted waits.
    service = started("serve")
    waiting = service.submitted(service.venue("open"))
    before = answers(service, job)
    assert service.stop() == 0
    new = servers.settings(tmp_path / "elsewhere")
    run = esc("home", "copy", str(folder), new["database_url"], "--blobs-to", new["blob_url"])
    assert run.returncode == 0, run.stderr
    assert files(new["blob_url"]) == files(service.blob_url)
    copy = started("serve", **environment(new))
    assert answers(copy, job) == before
    assert copy.stop() == 0
    both = started("up", **environment(new))
    assert both.end(waiting)["status"] == "succeeded"
    assert both.calibrated("v", 2)["venue_revision"] > job["venue_revision"]
    assert both.stop() == 0


# The command on a disk so slow that a signal comes before its end, however long the one who sends it had to wait. Where
# nohup started the tests, SIGHUP is ignored, and SIGINT where a shell did in the background.
ON_A_SLOW_DISK = """
import signal, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)
from service.store.blobs import Blobs
put = Blobs.put
Blobs.put = lambda *object: (put(*object), time.sleep(0.05))
from service.cli.main import main
main()
"""


def home_with_files(folder, count=300):
    a_row_in_every_table(Embedded().database_url(folder))
    (folder / "blobs" / "frames").mkdir(parents=True)
    for number in range(count):
        (folder / "blobs" / "frames" / f"{number}").write_bytes(b"a frame")


@pytest.mark.parametrize(
    "number", try_first([signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT]), ids=lambda n: n.name
)
def test_a_copy_that_is_ended_leaves_nothing_or_what_the_next_one_goes_on_with(tmp_path, number):
    here, there = tmp_path / "here", tmp_path / "there"
    home_with_files(here)
    command = [sys.executable, "-c", ON_A_SLOW_DISK, "home", "copy", str(here), str(there)]
    with Popen(command, cwd=tmp_path, stderr=PIPE, text=True) as copying:
        wait_for(lambda: any((there / "blobs" / "frames").glob("*")))
        copying.send_signal(number)
        # A second time, as by a user who is in a hurry.
        copying.send_signal(number)
        copying.communicate(timeout=60)
    assert copying.returncode in (128 + number, -number)
    assert (number == signal.SIGKILL) == bool(files((there / "blobs").as_uri()))
    assert (number == signal.SIGKILL) == (there / "esc.sqlite").exists()
    again = esc_process(tmp_path, "home", "copy", str(here), str(there))
    assert again.returncode == 0, again.stderr
    assert files((there / "blobs").as_uri()) == files((here / "blobs").as_uri())


def test_a_store_with_files_of_somebody_else_is_refused_and_left_alone(esc, tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    home_with_files(here, 3)
    (there / "blobs" / "frames").mkdir(parents=True)
    (there / "blobs" / "frames" / "theirs").write_bytes(b"a frame")
    run = esc("home", "copy", str(here), str(there))
    assert (run.returncode, "files that FROM has not (1, such as frames/theirs)" in run.stderr) == (2, True), run.stderr
    assert files((there / "blobs").as_uri()) == ["frames/theirs"]


def answers(service, job):
    """What GET answers, byte by byte; the pictures of a job too."""
    paths = (*GETS, *(job["links"][name] for name in ("self", "preview", "overlay/left")))
    return {path: service.http.get(path).raise_for_status().content for path in paths}


def test_a_service_that_runs_is_not_copied_from_either_kind_of_database(servers, esc, tmp_path):
    for number, home in enumerate((Embedded(), servers)):
        folder = tmp_path / f"esc{number}"
        running = Service(folder, "serve", **environment(home.settings(folder)))
        try:
            run = esc("home", "copy", place(home, folder), str(tmp_path / "there"), ESC_DATA=str(folder))
            assert (run.returncode, "The source is in use" in run.stderr) == (2, True), run.stderr
            assert not (tmp_path / "there" / "esc.sqlite").exists()
        finally:
            assert running.stop() == 0


def test_a_database_that_is_not_empty_or_of_another_schema_is_refused_and_left_alone(servers, esc, tmp_path):
    here, there = Embedded().database_url(tmp_path / "here"), servers.database_url(tmp_path / "there")
    for url in (here, there):
        a_row_in_every_table(url)
    before = every_row(there)
    run = esc("home", "copy", str(tmp_path / "here"), there)
    assert (run.returncode, "target is not empty" in run.stderr, "venues (1)" in run.stderr) == (2, True, True)
    assert every_row(there) == before
    engine = connect(here)
    with writing(engine) as connection:
        connection.exec_driver_sql("UPDATE esc_schema SET version_num = '0002'")
    engine.dispose()
    run = esc("home", "copy", str(tmp_path / "here"), str(tmp_path / "new"))
    assert (run.returncode, "schema 0002" in run.stderr) == (2, True)
    assert not (tmp_path / "new" / "esc.sqlite").exists()
    assert esc("home", "copy", str(tmp_path / "nothing"), there).returncode == 2
    assert esc("home", "copy", "mysql://host/name", there).returncode == 2


@pytest.mark.long
def test_what_fails_in_the_middle_leaves_the_target_empty(servers, esc, tmp_path):
    folder = tmp_path / "here"
    here, there = Embedded().database_url(folder), servers.settings(tmp_path / "there")
    a_row_in_every_table(here)
    (folder / "blobs" / "frames").mkdir(parents=True)
    (folder / "blobs" / "frames" / "one").write_bytes(b"a frame")
    engine = connect(here)
    with writing(engine) as connection:
        # SQLite takes any length, PostgreSQL does not; `workers` is the last table but some.
        connection.execute(sa.update(tables.workers).values(name="w" * 300))
    engine.dispose()
    run = esc("home", "copy", str(folder), there["database_url"], "--blobs-to", there["blob_url"])
    assert run.returncode == 1, run.stderr
    assert files(there["blob_url"]) == []
    engine = connect(there["database_url"])
    inspector = sa.inspect(engine)
    assert (inspector.get_table_names(), "dbos" in inspector.get_schema_names()) == ([], False)
    engine.dispose()
    # And what is put right is copied.
    engine = connect(here)
    with writing(engine) as connection:
        connection.execute(sa.update(tables.workers).values(name="w"))
    engine.dispose()
    run = esc("home", "copy", str(folder), there["database_url"], "--blobs-to", there["blob_url"])
    assert (run.returncode, files(there["blob_url"])) == (0, ["frames/one"]), run.stderr
