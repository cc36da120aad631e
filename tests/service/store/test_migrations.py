"""Data of every schema that was released, brought up to date, and read as if it had always been there."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory

from service.store.counts.figures import VenueQuality, look
from service.store.counts.outcomes import ENDED
from service.store.deliveries import Deliveries
from service.store.engine import MIGRATIONS, connect, migrate, writing
from service.store.expiry import Expiry
from service.store.ids import new_id
from service.store.jobs import Jobs, Submission
from service.store.keys import Keys
from service.store.venues import Venues
from service.store.workers import Workers
from service.wire.options import Board, IntrinsicsOptions, LocateOptions, Options
from service.wire.results import Result
from service.wire.venue import VENUE_EXAMPLE, VenueIn
from tests.homes import in_both_homes

REVISIONS = [script.revision for script in ScriptDirectory(str(MIGRATIONS)).walk_revisions()]
NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
VENUE = VenueIn.model_validate(VENUE_EXAMPLE).stored()
DONE, WAITING = "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", "01KAJ3Q6WZ5T3Y8R0N4M2C7B1E"
RECEIVER = "https://example.com/"
FIRST_POSE = VENUE.cameras[0].pose.model_copy(update={"position": [-1.5, -49.5, 7.9]})
FRAMES = {"left": [f"frames/{WAITING}/left/0"]}
RESULT = {
    "accepted": True,
    "rejected_because": None,
    "cameras": [
        {
            "id": "left",
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
    "venues": [{"id": VENUE.id, "document": VENUE.model_dump(mode="json"), "revision": 3, "updated_at": NOON}],
    # Until revision 0009.
    "pose_history": [
        {
            "venue": VENUE.id,
            "camera": "left",
            "pose": FIRST_POSE.model_dump(),
            "cause": "put",
            "since": NOON - timedelta(days=1),
        },
        {
            "venue": VENUE.id,
            "camera": "left",
            "pose": VENUE.cameras[0].pose.model_dump(),
            "cause": "calibration",
            "job": DONE,
            "since": NOON,
        },
    ],
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
    "leftovers": [{"folder": "frames/lost", "due_at": NOON}],
    "deliveries": [
        {
            # Called `id` since revision 0010.
            "job": DONE,
            "id": DONE,
            "url": RECEIVER,
            "status": "waiting",
            "attempts": 1,
            "due_at": NOON,
            "last_error": "timed out",
        }
    ],
    "alarms": [{"venue": VENUE.id, "rule": "not-calibrated", "camera": "", "since": NOON, "why": "No poses."}],
    "credentials": [{"venue": VENUE.id, "camera": "left", "userinfo": "user:secret"}],
    "schedules": [
        {"venue": VENUE.id, "cron": "0 3 * * *", "time_zone": "UTC", "due_at": NOON, "look_at": NOON, "last_job": DONE}
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
    "venue_quality": [{"venue": VENUE.id, "stitch_error_px": 0.2, "moved_px": 2.0, "accepted_at": NOON}],
}


@pytest.fixture
def old(home, tmp_path):
    """Make a database as a release of that revision left it."""
    engine = connect(home.database_url(tmp_path))

    def old(revision):
        with writing(engine) as connection:
            config = Config()
            config.set_main_option("script_location", str(MIGRATIONS))
            config.attributes["connection"] = connection
            command.upgrade(config, revision)
            tables = sa.MetaData()
            tables.reflect(connection)
            for name in tables.tables.keys() & ROWS.keys():
                insert_what_it_has_columns_for(connection, tables.tables[name], ROWS[name])
        return engine

    yield old
    engine.dispose()


def insert_what_it_has_columns_for(connection, table, rows):
    for row in rows:
        connection.execute(sa.insert(table).values({name: row[name] for name in row.keys() & table.columns.keys()}))


@in_both_homes
@pytest.mark.parametrize("revision", sorted(REVISIONS))
def test_what_an_older_release_stored_is_there_after_the_upgrade(old, revision):
    engine = old(revision)
    migrate(engine)
    venues, jobs = Venues(engine), Jobs(engine)
    assert venues.get(VENUE.id) == VENUE
    put, held = reversed(venues.history(VENUE.id, None, 10))
    assert (put.revision, put.cause, put.job, put.cameras[0].pose) == (1, "put", None, FIRST_POSE)
    assert (held.revision, held.cause, held.job, held.at) == (2, "calibrated", DONE, NOON)
    assert (held.cameras[0].pose, held.cameras[0].drift_since) == (VENUE.cameras[0].pose, 1)
    done = jobs.get(DONE)
    assert (done.status, done.created_at, done.finished_at) == ("succeeded", NOON, NOON)
    assert done.result == Result.model_validate(RESULT)
    assert jobs.same_as(VENUE.id, "k", "c" * 64).id == DONE
    assert jobs.get(WAITING).queue_position == 1
    task = jobs.begin(WAITING)
    assert (task.venue, task.options.seed, task.frames) == (VENUE, 7, FRAMES)
    assert task.origin.request_id == ("van-3" if revision >= "0007" else None)
    assert Workers(engine).silent(0) == ["w"]
    keys = Keys(engine).all()
    assert [(key.name, key.scope, key.last_used_at) for key in keys] == (
        [("cron", "calibrate", NOON)] if revision >= "0003" else []
    )
    assert Expiry(engine).leftovers(NOON, 10) == (["frames/lost"] if revision >= "0004" else [])
    due = Deliveries(engine).attempt(NOON, NOON, 10)
    assert [(delivery.id, delivery.attempt) for delivery in due] == ([(DONE, 2)] if revision >= "0005" else [])
    error = "timed out" if revision >= "0006" else None
    assert [state.last_error for state in [jobs.get(DONE).callback] if state] == ([error] if revision >= "0005" else [])
    health = venues.health(VENUE.id)
    assert [alarm.why for alarm in health.alarms] == (["No poses."] if revision >= "0010" else [])
    assert (health.revision, health.rejected_in_a_row) == (2, 0)
    assert venues.credentials(VENUE.id) == ({"left": "user:secret"} if revision >= "0011" else {})
    assert [state.last_job for state in [health.schedule] if state] == ([DONE] if revision >= "0012" else [])
    seen = look(engine, 10)
    assert seen.tallies == ({(ENDED, ("succeeded", "accepted", "")): 3} if revision >= "0007" else {})
    assert seen.venues == ([VenueQuality(VENUE.id, 0.2, 2.0, NOON)] if revision >= "0007" else [])


@in_both_homes
@pytest.mark.parametrize("revision", sorted(REVISIONS))
def test_an_upgraded_database_takes_new_rows(old, revision):
    engine = old(revision)
    migrate(engine)
    lens = Submission(
        new_id(),
        None,
        IntrinsicsOptions(board=Board(columns=9, rows=6, square_m=0.03)),
        "l",
        None,
        {},
        "intrinsics",
    )
    points = [{"world": [x, y], "pixel": [0, 0]} for x in (0, 1) for y in (0, 1)]
    clicks = LocateOptions.model_validate({"points": points})
    # A venue with an active calibration takes any number of first poses.
    place = Submission(new_id(), VENUE, clicks, "p", None, {"left": []}, "locate")
    for submission in (lens, place):
        job, new = Jobs(engine).submit(submission, 100, lambda *_: None)
        assert (new, job.kind, job.queue_position) == (True, submission.kind, 2 if submission is lens else 1)
        task = Jobs(engine).begin(job.id)
        assert (task.venue, task.options) == (submission.venue, submission.options)
    # Numbers go on where those of the old rows ended.
    moved = VENUE.cameras[0].pose.model_copy(update={"position": [0.0, -50.0, 9.0]})
    Venues(engine).put(VENUE.with_poses({"left": moved}), lambda _: None)
    held = Venues(engine).history(VENUE.id, None, 10)
    assert [(revision.revision, revision.cause) for revision in held] == [(3, "put"), (2, "calibrated"), (1, "put")]
    # What was never measured is not made up; what comes now is.
    assert [revision.cameras[0].moved is None for revision in held] == [False, True, True]
    Venues(engine).restore(VENUE.id, 1, lambda _: None)
    assert Venues(engine).get(VENUE.id).cameras[0].pose == FIRST_POSE
    key = Keys(engine).add("guest", "read", NOON + timedelta(days=36500))
    assert key.startswith("esc_")
    # What ended before files were ever deleted is past its time like any other.
    assert Expiry(engine).expire_frames(NOON + timedelta(days=2), NOON, 10) == 1
    assert f"frames/{DONE}" in Expiry(engine).leftovers(NOON, 10)
