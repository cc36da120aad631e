import threading
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from service.schemas.events.webhooks import Webhook
from service.schemas.job import JobError
from service.store import tables
from service.store.movement import picture_motion
from testbed.homes import in_both_homes
from testbed.stock import Stock


def told(stock, venue="v", seen=0, kinds=()):
    """The types of the events after one."""
    return [one.event.type for one in stock.events.since(venue, seen, kinds, 100).events]


@in_both_homes
def test_everything_that_happens_to_a_venue_is_an_event_in_its_order(stock):
    job = stock.calibrated("v")
    stock.venues.put(stock.venue("v").model_copy(update={"name": "Ground 2"}))
    failed = stock.submitted("v")
    stock.attempts.fail(stock.attempts.begin(failed), JobError(type="/problems/job-crashed", title="", detail=""))
    stock.decisions.cancel(stock.submitted("v"))
    stock.venues.delete("v")
    page = stock.events.since("v", 0, [], 100)
    assert [one.event.type for one in page.events] == [
        "venue.created",
        "poses.changed",
        "job.queued",
        "poses.changed",
        "job.succeeded",
        "venue.changed",
        "job.queued",
        "job.failed",
        "job.queued",
        "job.cancelled",
        "venue.deleted",
    ]
    put, calibrated = page.events[1].event.data, page.events[3].event.data
    assert (put.cause, put.revision, put.changed) == ("put", 1, ["left", "right"])
    assert (calibrated.cause, calibrated.job, calibrated.changed) == ("calibrated", job, ["left", "right"])
    assert page.events[5].event.data.changed == ["name"]
    assert page.events[7].event.data.id == failed
    assert told(stock, "other") == []


def test_new_poses_come_with_everything_that_draws_on_a_picture(stock):
    stock.calibrated("v", accepted=["right"])
    (event,) = (one.event for one in stock.events.since("v", 0, ["poses.changed"], 100).events[1:])
    assert event.data.changed == ["right"]
    assert event.data.cameras == [camera.posed for camera in stock.venue("v").cameras]
    assert event.data.revision == stock.venues.health("v").revision


def test_new_poses_come_with_how_the_pictures_of_changed_cameras_moved(stock):
    stock.calibrated("v", accepted=["right"])
    first, second = (one.event.data for one in stock.events.since("v", 0, ["poses.changed"], 100).events)
    assert (first.revision, first.picture_motions) == (1, {})
    before, after = ({camera.id: camera for camera in poses.cameras}["right"] for poses in (first, second))
    assert second.picture_motions == {"right": picture_motion(stock.venue("v").field, (1, before), (2, after))}
    assert stock.events.beginning("v", None).event.data.picture_motions == {}


@in_both_homes
def test_who_has_seen_nothing_begins_with_the_poses_that_hold_and_misses_nothing_after_them(stock):
    stock.calibrated("v")
    beginning = stock.events.beginning("v", None)
    assert beginning.event.type == "poses.current"
    assert beginning.event.data.revision == 2
    assert told(stock, seen=beginning.number) == []
    stock.moved_by_hand("v", 3.0)
    assert told(stock, seen=beginning.number) == ["venue.changed", "poses.changed"]
    assert stock.events.beginning("v", beginning.number) is None


@in_both_homes
def test_what_is_past_its_time_goes_and_who_may_have_missed_it_begins_anew(stock):
    stock.calibrated("v")
    newest = stock.events.newest(["v"])["v"]
    now = datetime.now(UTC) + timedelta(minutes=1)
    assert stock.expiry.expire_events(now - timedelta(hours=1), 100) == 0
    assert stock.expiry.expire_events(now, 2) == 2
    assert stock.events.beginning("v", 2) is None
    assert stock.events.beginning("v", 1).event.type == "poses.current"
    # The newest stays, and tells that nothing was missed.
    assert stock.expiry.expire_events(now, 100) == newest - 3
    assert stock.events.beginning("v", newest) is None
    assert stock.events.beginning("v", newest - 2).number == newest
    # A number of another database.
    assert stock.events.beginning("v", newest + 1).number == newest


def test_no_number_is_given_twice_on_sqlite(tmp_path):
    stock = Stock(tmp_path)
    stock.venue("v")
    with stock.engine.begin() as connection:
        last = connection.scalar(sa.select(sa.func.max(tables.events.c.id)))
        connection.execute(sa.delete(tables.events))
    stock.moved_by_hand("v", 3.0)
    assert min(one.number for one in stock.events.since("v", 0, [], 10).events) > last
    stock.engine.dispose()


def test_that_a_job_was_submitted_is_told_as_it_was_submitted_whatever_became_of_it(stock):
    job = stock.calibrated("v")
    (queued,) = stock.events.since("v", 0, ["job.queued"], 100).events
    (ended,) = stock.events.since("v", 0, ["job.succeeded"], 100).events
    assert (queued.event.data.id, queued.event.data.status, queued.event.data.queue_position) == (job, "queued", 1)
    assert queued.event.data.result is None
    assert queued.event.timestamp == queued.event.data.created_at
    assert (ended.event.data.id, ended.event.data.status) == (job, "succeeded")


def test_the_event_of_a_job_that_was_deleted_is_passed_over(stock):
    job = stock.calibrated("v")
    stock.expiry.delete_jobs([job], datetime.now(UTC))
    assert told(stock) == ["venue.created", "poses.changed", "poses.changed"]


@in_both_homes
def test_who_follows_misses_no_event_of_transactions_that_run_at_once(stock):
    stock.venue("v")
    seen, found, over = stock.events.newest(["v"])["v"], [], threading.Event()
    # Between giving a number and being seen there is time for others.
    sa.event.listen(stock.engine, "after_cursor_execute", lambda *_: time.sleep(0.002))

    def follow() -> None:
        number, ending = seen, False
        while not ending:
            ending = over.is_set()
            page = stock.events.since("v", number, ["venue.*"], 100)
            number = page.up_to
            found.extend(one.number for one in page.events)

    def rename(n: int) -> None:
        stock.venues.patch("v", lambda venue: (venue.model_copy(update={"name": f"{n}"}), {}))

    with ThreadPoolExecutor(5) as pool:
        following = pool.submit(follow)
        list(pool.map(rename, range(12)))
        over.set()
        following.result()
    assert len(found) == 12


@in_both_homes
def test_webhooks_are_told_what_they_want(stock):
    wants = {"https://a.example/": ["poses.changed"], "https://b.example/": ["job.*", "alarm.*"]}
    webhooks = [Webhook(url=url, events=events) for url, events in wants.items()]
    stock.venues.put(stock.venue("v").model_copy(update={"webhooks": webhooks}))
    stock.calibrated("v")
    d = tables.deliveries.c
    with stock.engine.connect() as connection:
        rows = connection.execute(sa.select(d.url, d.event).order_by(d.event)).all()
    assert [(row.url, stock.events.get(row.event).type) for row in rows] == [
        ("https://b.example/", "job.queued"),
        ("https://a.example/", "poses.changed"),
        ("https://b.example/", "job.succeeded"),
    ]
