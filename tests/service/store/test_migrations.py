"""Data of every schema that was released, brought up to date, and read as if it had always been there."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from service.schemas.geometry import Pose
from service.schemas.options import Board, IntrinsicsOptions, LocateOptions, Options
from service.schemas.results import Result
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store import tables
from service.store.database import MIGRATIONS, SCHEMA_TABLE, UnsupportedDatabase, connect, migrate, writing
from service.store.ids import new_id
from service.store.jobs.submission import Submission
from service.store.repositories import Repositories
from service.store.statistics.job_outcome import ENDED
from service.store.statistics.snapshot import VenueGauges, read_statistics
from testbed.homes import in_both_homes

pytestmark = pytest.mark.slow

REVISIONS = [script.revision for script in ScriptDirectory(str(MIGRATIONS)).walk_revisions()]
NEWEST = max(REVISIONS)
NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
VENUE = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
DONE, WAITING = "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", "01KAJ3Q6WZ5T3Y8R0N4M2C7B1E"
RECEIVER = "https://example.com/"
FIRST_POSE = Pose.from_position(VENUE.cameras[0].pose.rotation, [-1.5, -49.5, 7.9])
FRAMES = {"left": [f"frames/{WAITING}/left/0"]}
RESULT = {
    "verdict": "accepted",
    "accepted": True,
    "rejected_because": None,
    "cameras": [
        {
            "id": "left",
            "accepted": True,
            "rejected_because": None,
            "pose": VENUE.cameras[0].pose.model_dump(),
            "sigma": None,
            "moved": {"rotation_deg": 0.0, "position_m": 0.1, "pixels": 2.0},
            "iou": 0.9,
            "residual_px": 1.0,
        }
    ],
    "stitch_error_px": None,
    "stitch_error_before_px": None,
    "loss": 0.1,
    "generations": 10,
    "timings_s": {"decode": 0.1},
    "provenance": {"software": "0.1.0", "model_sha256": "f" * 64, "seed": 7, "options": {}},
}


def job(id_, **values):
    return {
        "id": id_,
        "venue": VENUE.id,
        "priority": 100,
        "options": Options(seed=7).model_dump(mode="json"),
        "content_hash": "c" * 64,
        "venue_document": VENUE.model_dump(mode="json"),
        "frames": FRAMES,
        "attempt": 0,
        "revision": 1,
        "created_at": NOON,
        "updated_at": NOON,
        **values,
    }


# What each table held at the first revision, and what later ones added.
ROWS = {
    "venues": [{"id": VENUE.id, "document": VENUE.model_dump(mode="json"), "updated_at": NOON}],
    "jobs": [
        job(
            DONE,
            status="succeeded",
            options=Options(seed=7, callback_url=RECEIVER).model_dump(mode="json"),
            result=RESULT,
            run_token="t",
            idempotency_key="k",
            finished_at=NOON,
        ),
        job(WAITING, status="queued", request_id="van-3", traceparent=None),
    ],
    "workers": [{"name": "w", "model_sha256": "f" * 64, "started_at": NOON, "seen_at": NOON}],
    "api_keys": [{"name": "cron", "hash": "0" * 64, "scope": "calibrate", "created_at": NOON, "last_used_at": NOON}],
    "sessions": [{"hash": "1" * 64, "key_hash": "0" * 64, "expires_at": NOON + timedelta(days=36500)}],
    "leftovers": [{"folder": "frames/lost", "due_at": NOON}],
    "deliveries": [
        {
            "id": DONE,
            "url": RECEIVER,
            "receiver": "example.com",
            "status": "waiting",
            "attempts": 1,
            "due_at": NOON,
            "last_error": "timed out",
        }
    ],
    "alarms": [{"venue": VENUE.id, "rule": "not-calibrated", "camera": "", "since": NOON, "why": "No poses."}],
    "credentials": [{"venue": VENUE.id, "camera": "left", "userinfo": "user:secret"}],
    "schedules": [
        {
            "venue": VENUE.id,
            "cron": "0 3 * * *",
            "time_zone": "UTC",
            "exact": True,
            "due_at": NOON,
            "look_at": NOON,
            "last_job": DONE,
        }
    ],
    "events": [
        {"venue": VENUE.id, "type": "venue.created", "at": NOON, "data": {"venue": VENUE.id, "changed": []}},
        {"venue": VENUE.id, "type": "job.succeeded", "at": NOON, "job": DONE},
    ],
    "tallies": [{"metric": ENDED, "labels": "succeeded,accepted,", "value": 3}],
    "revisions": [
        {
            "venue": VENUE.id,
            "number": number,
            "at": NOON - timedelta(days=2 - number),
            "cause": cause,
            "job": job,
            "cameras": [VENUE.cameras[0].model_copy(update={"pose": pose}).posed.model_dump(mode="json")],
            "ridge": VENUE.field.ridge,
            "movements": {"left": {"moved": None, "drift": None, "drift_since": 1}},
        }
        for number, cause, job, pose in ((1, "put", None, FIRST_POSE), (2, "calibrated", DONE, VENUE.cameras[0].pose))
    ],
    "memories": [{"venue": VENUE.id, "revision": 2, "document": {"left": {"format": 1}}}],
    "venue_quality": [{"venue": VENUE.id, "stitch_error_px": 0.2, "moved_px": 2.0, "accepted_at": NOON}],
}


@pytest.fixture
def upgraded(home, tmp_path):
    """Bring up to date what a release of that revision left."""
    url = home.database_url(tmp_path)
    engine = connect(url)

    def upgraded(revision):
        with writing(engine) as connection:
            config = Config()
            config.set_main_option("script_location", str(MIGRATIONS))
            config.attributes["connection"] = connection
            command.upgrade(config, revision)
            then = sa.MetaData()
            then.reflect(connection)
            for name in then.tables.keys() & ROWS.keys():
                insert_what_it_has_columns_for(connection, then.tables[name], ROWS[name])
        engine.dispose()
        stores.append(Repositories(url))
        return stores[-1]

    stores = []
    yield upgraded
    for opened in stores:
        opened.engine.dispose()


def insert_what_it_has_columns_for(connection, table, rows):
    for row in rows:
        connection.execute(sa.insert(table).values({name: row[name] for name in row.keys() & table.columns.keys()}))


@in_both_homes
@pytest.mark.parametrize("revision", sorted(REVISIONS))
def test_what_an_older_release_stored_is_there_after_the_upgrade(upgraded, revision):
    stores = upgraded(revision)
    venues, jobs = stores.venues, stores.jobs
    assert venues.get(VENUE.id) == VENUE
    put, held = reversed(venues.history(VENUE.id, None, 10))
    assert (put.revision, put.cause, put.job, put.cameras[0].pose) == (1, "put", None, FIRST_POSE)
    assert (held.revision, held.cause, held.job, held.at) == (2, "calibrated", DONE, NOON)
    assert (held.cameras[0].pose, held.cameras[0].drift_since) == (VENUE.cameras[0].pose, 1)
    done = jobs.get(DONE)
    assert (done.status, done.created_at, done.finished_at) == ("succeeded", NOON, NOON)
    assert done.result == Result.model_validate(RESULT)
    assert stores.submissions.same_as(VENUE.id, "k", "c" * 64).id == DONE
    assert jobs.get(WAITING).queue_position == 1
    task = stores.attempts.begin(WAITING)
    assert (task.venue, task.options.seed, task.frames) == (VENUE, 7, FRAMES)
    assert task.origin.request_id == "van-3"
    # A release without memories leaves none, and its jobs begin them.
    assert (task.memories, task.taken_at) == ({} if revision == "0001" else {"left": {"format": 1}}, NOON)
    assert stores.workers.silent(0) == ["w"]
    (key,) = stores.keys.all()
    assert (key.name, key.scope, key.last_used_at) == ("cron", "calibrate", NOON)
    assert stores.sessions.key_of("1" * 64) == key
    assert stores.expiry.leftovers(NOON, 10) == ["frames/lost"]
    (due,) = stores.outbox.claim_due(NOON, NOON, 10)
    assert (due.id, due.attempt, jobs.get(DONE).callback.last_error) == (DONE, 2, "timed out")
    health = venues.health(VENUE.id)
    assert [alarm.why for alarm in health.alarms] == ["No poses."]
    assert (health.revision, health.rejected_in_a_row, health.schedule.last_job) == (2, 0, DONE)
    assert venues.with_credentials(VENUE.id)[1] == {"left": "user:secret"}
    seen = read_statistics(stores.engine, 10)
    assert seen.counters == {(ENDED, ("succeeded", "accepted", "")): 3}
    assert seen.venues == [VenueGauges(VENUE.id, 0.2, 2.0, NOON)]


@in_both_homes
@pytest.mark.parametrize("revision", sorted(REVISIONS))
def test_an_upgraded_database_takes_new_rows(upgraded, revision):
    stores = upgraded(revision)
    lens = Submission(
        job_id=new_id(),
        kind="intrinsics",
        venue=None,
        options=IntrinsicsOptions(board=Board(columns=9, rows=6, square_m=0.03)),
        frames={},
        content_hash="l",
        idempotency_key=None,
    )
    points = [{"world": [x, y], "pixel": [0, 0]} for x in (0, 1) for y in (0, 1)]
    clicks = LocateOptions.model_validate({"points": points})
    # A venue with an active calibration takes any number of first poses.
    place = Submission(
        job_id=new_id(),
        kind="locate",
        venue=VENUE,
        options=clicks,
        frames={"left": []},
        content_hash="p",
        idempotency_key=None,
    )
    for submission in (lens, place):
        job, new = stores.submissions.submit(submission, 100, lambda *_: None)
        assert (new, job.kind, job.queue_position) == (True, submission.kind, 2 if submission is lens else 1)
        task = stores.attempts.begin(job.id)
        assert (task.venue, task.options) == (submission.venue, submission.options)
    # Numbers go on where those of the old rows ended.
    moved = Pose.from_position(VENUE.cameras[0].pose.rotation, [0.0, -50.0, 9.0])
    stores.venues.put(VENUE.with_poses({"left": moved}), lambda _: None)
    held = stores.venues.history(VENUE.id, None, 10)
    assert [(revision.revision, revision.cause) for revision in held] == [(3, "put"), (2, "calibrated"), (1, "put")]
    # What was never measured is not made up; what comes now is.
    assert [revision.cameras[0].moved is None for revision in held] == [False, True, True]
    stores.venues.restore(VENUE.id, 1, lambda _: None)
    assert stores.venues.get(VENUE.id).cameras[0].pose == FIRST_POSE
    key = stores.keys.add("guest", "read", NOON + timedelta(days=36500))
    assert key.startswith("esc_")
    (old,) = stores.expiry.old_frames(NOON + timedelta(days=2), 10)
    stores.expiry.expire_frames([old.job_id], NOON)
    assert f"frames/{DONE}" in stores.expiry.leftovers(NOON, 10)


@in_both_homes
def test_the_migrations_make_the_tables_that_the_code_knows(engine, home, tmp_path):
    with engine.connect() as connection:
        compared = MigrationContext.configure(connection, opts={"version_table": SCHEMA_TABLE})
        assert compare_metadata(compared, tables.metadata) == []
    # Alembic does not compare conditions.
    as_the_code_says = connect(home.database_url(tmp_path / "other"))
    tables.metadata.create_all(as_the_code_says)
    assert conditions_of_indexes(engine) == conditions_of_indexes(as_the_code_says)
    as_the_code_says.dispose()


def conditions_of_indexes(engine):
    reflected = sa.MetaData()
    reflected.reflect(engine)
    indexes = [index for table in reflected.tables.values() for index in table.indexes]
    return {index.name: str(index.dialect_options[engine.dialect.name].get("where")) for index in indexes}


@in_both_homes
def test_migrating_twice_changes_nothing(engine):
    migrate(engine)


@in_both_homes
def test_a_database_from_before_the_first_release_is_told_and_left_alone(home, tmp_path):
    engine = connect(home.database_url(tmp_path))
    with writing(engine) as connection:
        for statement in (
            "CREATE TABLE jobs (id VARCHAR(26))",
            "CREATE TABLE alembic_version (version_num VARCHAR(32))",
            "INSERT INTO alembic_version VALUES ('0001')",
        ):
            connection.exec_driver_sql(statement)
    with pytest.raises(UnsupportedDatabase, match=rf"development version .* begins with schema {NEWEST} .* new place"):
        migrate(engine)
    assert sorted(sa.inspect(engine).get_table_names()) == ["alembic_version", "jobs"]
    engine.dispose()


@in_both_homes
def test_a_database_that_a_newer_version_has_upgraded_is_told(engine):
    with writing(engine) as connection:
        connection.exec_driver_sql(f"UPDATE {SCHEMA_TABLE} SET version_num = '0999'")
    with pytest.raises(
        UnsupportedDatabase, match=rf"has schema 0999, .* knows none after {NEWEST}: .* restore the backup"
    ):
        migrate(engine)
