"""Databases of the last release, brought up to date, and databases that this version refuses."""

import re

import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from service.store import tables
from service.store.database import SCHEMA_TABLE, UnsupportedDatabase, connect, migrate, newest_schema, writing
from service.store.repositories import Repositories
from testbed.homes import in_both_homes
from testbed.released import load_dump

pytestmark = pytest.mark.slow


@pytest.fixture
def upgraded(home, tmp_path):
    """The repositories of a database of the last release, brought up to date."""
    load_dump(home, tmp_path / "dump")
    stores = Repositories(home.database_url(tmp_path / "dump"))
    yield stores
    stores.engine.dispose()


@in_both_homes
def test_an_upgraded_database_has_the_tables_that_an_empty_one_gets(upgraded, engine):
    with upgraded.engine.connect() as connection:
        # The queue of SQLite has its tables in the same file.
        compared = MigrationContext.configure(connection, opts={"include_name": is_own})
        assert compare_metadata(compared, tables.metadata) == []
    # Alembic does not compare conditions.
    assert conditions_of_indexes(upgraded.engine) == conditions_of_indexes(engine)


def is_own(name, kind, _):
    return kind != "table" or name in tables.metadata.tables


def conditions_of_indexes(engine):
    """Return the conditions by index, without casts and brackets, which a dump of PostgreSQL writes otherwise."""
    reflected = sa.MetaData()
    reflected.reflect(engine, only=list(tables.metadata.tables))
    indexes = [index for table in reflected.tables.values() for index in table.indexes]
    conditions = {index.name: str(index.dialect_options[engine.dialect.name].get("where")) for index in indexes}
    return {name: re.sub(r"::[a-z ]+|[\[\]()]", "", condition) for name, condition in conditions.items()}


@in_both_homes
def test_what_the_last_release_kept_in_additions_is_in_the_documents(upgraded):
    venue = upgraded.venues.get("everything")
    assert (venue.view.width_px, venue.recover, venue.alarms.trend_m) == (1280, "accept", 0.2)
    assert (venue.alarms.rejected_in_a_row, venue.schedule.frames, venue.field.uneven_m) == (1, 2, 0.004)
    assert venue.cameras[0].light.gain == [1.06, 1.0, 0.94]
    first = upgraded.submissions.same_as("everything", "first", content_of(upgraded, "first"))
    assert [camera.nights for camera in first.result.cameras] == [1, 1]
    assert upgraded.submissions.of(first.id).venue.view == venue.view


def content_of(stores, key):
    j = tables.jobs.c
    with stores.engine.connect() as connection:
        return connection.scalar(sa.select(j.content_hash).where(j.idempotency_key == key))


@in_both_homes
def test_migrating_twice_changes_nothing(engine):
    migrate(engine)


@in_both_homes
@pytest.mark.parametrize(
    ("statement", "found"),
    [
        (f"CREATE TABLE {SCHEMA_TABLE} AS SELECT '0008' AS version_num", "schema 0008"),
        ("CREATE TABLE jobs (id VARCHAR(26))", "no schema number, but tables such as jobs"),
    ],
)
def test_a_database_from_before_the_last_release_is_refused_and_left_alone(home, tmp_path, statement, found):
    engine = connect(home.database_url(tmp_path))
    with writing(engine) as connection:
        connection.exec_driver_sql(statement)
    before = sa.inspect(engine).get_table_names()
    taken = rf"has {found}: .*schema 0009 to {newest_schema()}.* Set ESC_DATA.* new place"
    with pytest.raises(UnsupportedDatabase, match=taken):
        migrate(engine)
    assert sa.inspect(engine).get_table_names() == before
    engine.dispose()


@in_both_homes
def test_a_database_that_a_newer_version_has_upgraded_is_refused(engine):
    with writing(engine) as connection:
        connection.exec_driver_sql(f"UPDATE {SCHEMA_TABLE} SET version_num = '0999'")
    known = rf"has schema 0999, .* knows none after {newest_schema()}: .* restore the backup"
    with pytest.raises(UnsupportedDatabase, match=known):
        migrate(engine)
