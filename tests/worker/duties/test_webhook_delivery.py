import json
import time
from base64 import b64encode
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from threading import Barrier

import pytest
import sqlalchemy as sa
from structlog.contextvars import merge_contextvars
from structlog.testing import capture_logs

from service.schemas.health import Alarms
from service.store import tables
from service.store.events.outbox import AT_ONCE_PER_RECEIVER
from service.store.jobs.queries import JobPage
from testbed.homes import in_both_homes, in_one_home_first
from testbed.stock import Stock
from tests.worker.receiver import Holding, Receiver, Talkative, resolve_to
from worker.duties import webhook_request
from worker.duties.webhook_delivery import AT_ONCE, ATTEMPT, WebhookDelivery

pytestmark = pytest.mark.slow

SECRET = "whsec_" + b64encode(bytes(32)).decode()
LOCAL = {"webhook_secret": SECRET, "callback_allow_http": True, "callback_allow_private": True}


class Clock:
    def __init__(self) -> None:
        # Deliveries are due from the end of their job, which the real clock tells, however long that takes here.
        self.now = datetime.now(UTC) + timedelta(minutes=5)

    def __call__(self) -> datetime:
        return self.now

    def goes_on(self, **time) -> None:
        self.now += timedelta(**time)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def stock(home, tmp_path):
    """Makes homes with other settings than the usual; all of them are let go."""
    home.make_database(tmp_path)
    stocks = []

    def stock(**settings):
        stocks.append(Stock(tmp_path, **(LOCAL | home.settings(tmp_path) | settings)))
        return stocks[-1]

    yield stock
    for one in stocks:
        one.engine.dispose()
    home.give_back(tmp_path)


def callbacks(stock, clock) -> WebhookDelivery:
    return WebhookDelivery(stock.settings, stock, clock)


def look(sender: WebhookDelivery) -> None:
    """Look once, and wait for what comes of it."""
    sender.poll()
    sender.finish()


def ended(stock, url: str, **more) -> str:
    return stock.ended("v", datetime.now(UTC), callback_url=url, **more)


@in_one_home_first
def test_the_end_of_a_job_is_told_with_the_job(stock, receiver, clock):
    home, hook = stock(), receiver()
    job = ended(home, hook.url)
    look(callbacks(home, clock))
    (told,) = hook.received
    event = json.loads(told.body)
    assert event["type"] == "job.succeeded"
    assert event["data"] == json.loads(home.jobs.get(job).model_dump_json()) | {"callback": None}
    assert event["timestamp"] == event["data"]["finished_at"]
    assert (told.path, told.headers["content-type"]) == ("/told?by=esc", "application/json")
    assert told.headers["host"] == f"127.0.0.1:{hook.port}"
    assert home.callbacks() == {"delivered": 1}
    clock.goes_on(days=2)
    look(callbacks(home, clock))
    assert len(hook.received) == 1


@pytest.mark.parametrize("how", ["job.failed", "job.cancelled"])
def test_every_end_is_told(stock, receiver, clock, how):
    home, hook = stock(), receiver()
    if how == "job.failed":
        ended(home, hook.url, accepted=None)
    else:
        home.decisions.cancel(home.submitted("v", callback_url=hook.url))
    look(callbacks(home, clock))
    assert json.loads(hook.received[0].body)["type"] == how


@in_both_homes
def test_an_alarm_is_told_when_it_begins_and_when_it_is_over_and_nothing_is_left(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 500, 204)
    rules = Alarms(rejected_in_a_row=1, callback_url=hook.url)
    home.venues.put(home.venue("v").model_copy(update={"alarms": rules}))
    home.calibrated("v", accepted=False)
    duty = callbacks(home, clock)
    look(duty)
    clock.goes_on(minutes=1)
    look(duty)
    home.calibrated("v")
    look(duty)
    failed, began, ended = hook.received
    assert failed.headers["webhook-id"] == began.headers["webhook-id"] != ended.headers["webhook-id"]
    event = json.loads(began.body)
    assert (event["type"], event["timestamp"]) == ("alarm.began", event["data"]["since"])
    assert event["data"] == {
        "venue": "v",
        "rule": "rejected-in-a-row",
        "setting": "rejected_in_a_row",
        "camera": None,
        "since": event["timestamp"],
        "why": "The last 1 calibrations were rejected or failed.",
    }
    assert json.loads(ended.body)["type"] == "alarm.ended"
    signed = webhook_request.headers(ended.headers["webhook-id"], clock.now, ended.body, home.settings.webhook_keys)
    assert ended.headers.items() >= signed.items()
    assert home.callbacks() == {}


def test_the_log_says_what_was_delivered_and_of_which_venue(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 204, 500, 204, 204)
    rules = Alarms(rejected_in_a_row=1, callback_url=hook.url)
    job = ended(home, hook.url)
    home.venues.put(home.venue("w").model_copy(update={"alarms": rules}))
    duty = callbacks(home, clock)
    with capture_logs(processors=[merge_contextvars]) as lines:
        look(duty)
        home.calibrated("w", accepted=False)
        look(duty)
        clock.goes_on(minutes=1)
        look(duty)
    said = [{name: line.get(name) for name in ("event", "what", "venue", "job", "why")} for line in lines]
    alarm = {"what": "alarm.began", "venue": "w", "job": None}
    assert said == [
        {"event": "callback delivered", "what": "job.succeeded", "venue": "v", "job": job, "why": None},
        {"event": "callback failed", "why": "answered 500"} | alarm,
        {"event": "callback delivered", "why": None} | alarm,
    ]


def test_a_job_that_asked_for_nothing_is_not_told_of(stock):
    home = stock()
    home.ended("v", datetime.now(UTC))
    assert home.callbacks() == {}


def test_a_cancelled_job_is_told_of_once(stock):
    home = stock()
    job = home.submitted("v", callback_url="https://example.com/")
    home.decisions.cancel(job)
    home.decisions.cancel(job)
    assert home.callbacks() == {"waiting": 1}


# Again and again


@in_one_home_first
def test_what_fails_is_sent_again_after_ever_longer_pauses_with_the_same_id(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 500, 302, 404, 200)
    job = ended(home, hook.url)
    sender = callbacks(home, clock)
    for pause_s in (0, 6, 33, 132):
        clock.goes_on(seconds=pause_s - 4)
        look(sender)
        clock.goes_on(seconds=4)
        look(sender)
    assert [told.headers["webhook-id"] for told in hook.received] == [job] * 4
    assert len({told.headers["webhook-timestamp"] for told in hook.received}) == 4
    assert len({told.body for told in hook.received}) == 1
    assert home.callbacks() == {"delivered": 1}


@in_one_home_first
def test_the_job_says_how_far_the_telling_has_come(stock, receiver, clock):
    home, hook = stock(), receiver(Talkative, 500, 200)
    waiting = home.submitted("a", callback_url=hook.url)
    assert home.jobs.get(waiting).callback is None
    home.decisions.cancel(waiting)
    assert home.jobs.get(waiting).callback.model_dump(exclude={"next_attempt_at"}) == {
        "state": "waiting",
        "attempts": 0,
        "last_error": None,
    }
    look(callbacks(home, clock))
    failed = home.jobs.get(waiting).callback
    assert (failed.state, failed.attempts) == ("waiting", 1)
    assert failed.last_error == "answered 500"
    assert failed.next_attempt_at > clock.now
    clock.goes_on(seconds=6)
    look(callbacks(home, clock))
    told = home.jobs.get(waiting).callback
    assert (told.state, told.attempts, told.next_attempt_at) == ("delivered", 2, None)
    assert [job.callback for job in home.jobs.page(JobPage(10)).jobs] == [told]


@in_one_home_first
def test_a_receiver_that_is_gone_is_left_alone_and_the_job_says_why(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 410)
    job = ended(home, hook.url)
    sender = callbacks(home, clock)
    look(sender)
    end = home.jobs.get(job).callback
    assert (end.state, end.last_error, end.next_attempt_at) == ("given-up", "its receiver is gone (410)", None)
    clock.goes_on(days=1)
    look(sender)
    assert len(hook.received) == 1


def test_after_a_day_it_is_given_up(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 500)
    ended(home, hook.url)
    sender, begun, last = callbacks(home, clock), clock.now, clock.now
    while home.callbacks() == {"waiting": 1}:
        before = len(hook.received)
        look(sender)
        if len(hook.received) > before:
            last = clock.now
        clock.goes_on(minutes=10)
    assert home.callbacks() == {"given-up": 1}
    assert len(hook.received) == 11
    assert timedelta(hours=23) < last - begun < timedelta(hours=30)


def test_a_receiver_may_ask_for_a_longer_pause(stock, receiver, clock):
    home, hook = stock(), receiver(Receiver, 503, headers={"Retry-After": "600"})
    ended(home, hook.url)
    sender = callbacks(home, clock)
    for seconds, arrived in ((0, 1), (590, 1), (80, 2)):
        clock.goes_on(seconds=seconds)
        look(sender)
        assert len(hook.received) == arrived


@in_both_homes
def test_a_sender_that_died_over_an_attempt_loses_nothing(stock, receiver, clock):
    home, hook = stock(), receiver()
    ended(home, hook.url)
    assert home.outbox.claim_due(clock.now, clock.now + ATTEMPT, 8)
    sender = callbacks(home, clock)
    look(sender)
    assert hook.received == []
    clock.goes_on(seconds=ATTEMPT.total_seconds())
    look(sender)
    assert home.callbacks() == {"delivered": 1}


@in_both_homes
def test_workers_that_look_at_once_do_not_attempt_the_same(stock, clock):
    home, workers = stock(), 4
    for _ in range(3):
        ended(home, "https://example.com/")
    # Between looking and writing there is time for the others.
    sa.event.listen(home.engine, "after_cursor_execute", lambda *_: time.sleep(0.05))
    together = Barrier(workers)

    def attempt(_):
        together.wait()
        return home.outbox.claim_due(clock.now, clock.now + ATTEMPT, 2)

    with ThreadPoolExecutor(workers) as pool:
        attempts = [delivery for found in pool.map(attempt, range(workers)) for delivery in found]
    assert [delivery.attempt for delivery in attempts] == [1, 1, 1]
    assert len({delivery.id for delivery in attempts}) == 3


def test_an_attempt_that_was_overtaken_by_the_next_one_writes_nothing(stock, clock):
    home = stock()
    ended(home, "https://example.com/")
    (slow,) = home.outbox.claim_due(clock.now, clock.now, 1)
    (next_one,) = home.outbox.claim_due(clock.now, clock.now + ATTEMPT, 1)
    home.outbox.give_up(slow, "no answer")
    home.outbox.retry_later(slow, clock.now, "no answer")
    assert home.callbacks() == {"waiting": 1}
    assert home.outbox.claim_due(clock.now, clock.now + ATTEMPT, 1) == []
    home.outbox.mark_delivered(next_one)
    assert home.callbacks() == {"delivered": 1}


def test_a_worker_without_a_secret_sends_nothing_unsigned(stock, receiver, clock):
    home, hook = stock(webhook_secret=None), receiver()
    ended(home, hook.url)
    look(callbacks(home, clock))
    assert (hook.received, home.callbacks()) == ([], {"waiting": 1})


def test_one_address_that_cannot_be_called_holds_up_no_other(stock, receiver, clock):
    home, hook = stock(), receiver()
    for url in ("https://a..b/", "https://" + "a" * 70 + ".example/", "http://127.0.0.1:1/", hook.url):
        ended(home, url)
    look(callbacks(home, clock))
    assert home.callbacks() == {"delivered": 1, "waiting": 3}


def test_a_receiver_that_takes_its_time_holds_up_no_other(stock, receiver, clock, monkeypatch):
    monkeypatch.setattr(webhook_request, "TIMEOUT_S", 60)
    home, slow, hook = stock(), receiver(Holding), receiver()
    # More than are sent at once were due before.
    resolve_to(monkeypatch, ["127.0.0.1"])
    for _ in range(AT_ONCE + 1):
        ended(home, f"http://slow.example:{slow.port}/")
    ended(home, hook.url)
    sender = callbacks(home, clock)
    while not hook.received:
        sender.poll()
    assert len(slow.received) <= AT_ONCE_PER_RECEIVER
    slow.go.set()
    sender.finish()


def test_attempts_that_go_on_count_among_those_that_one_receiver_has_at_once(stock, clock):
    home = stock()
    for name in ("slow", "slow", "other"):
        ended(home, f"https://{name}.example/")
    going_on = {"slow.example": AT_ONCE_PER_RECEIVER - 1}
    claimed = home.outbox.claim_due(clock.now, clock.now + ATTEMPT, AT_ONCE, going_on)
    assert sorted(delivery.receiver for delivery in claimed) == ["other.example", "slow.example"]


def test_many_ends_are_told_to_one_receiver_without_pauses(stock, receiver, clock):
    home, hook = stock(), receiver()
    for _ in range(3 * AT_ONCE_PER_RECEIVER):
        ended(home, hook.url)
    sender = callbacks(home, clock)
    all_delivered = {"delivered": 3 * AT_ONCE_PER_RECEIVER}
    while home.callbacks() != all_delivered:
        pause = sender.poll()
        # The last of them may have been told while it looked for more.
        assert pause == 0.0 or home.callbacks() == all_delivered


@in_both_homes
def test_a_clock_that_was_ahead_and_is_put_right_keeps_no_delivery_waiting(stock, receiver, clock):
    home, hook, busy = stock(), receiver(), receiver(Receiver, 503, 204)
    clock.goes_on(hours=6)
    ended(home, busy.url)
    look(callbacks(home, clock))
    ended(home, hook.url)
    with home.engine.begin() as connection:
        # The clock of the database was as far ahead when the second job ended.
        of_hook = sa.update(tables.deliveries).where(tables.deliveries.c.url == hook.url)
        connection.execute(of_hook.values(due_at=clock.now))
    clock.goes_on(hours=-6)
    sender = callbacks(home, clock)
    look(sender)
    assert (len(hook.received), len(busy.received)) == (1, 1)
    clock.goes_on(seconds=ATTEMPT.total_seconds() + 1)
    look(sender)
    assert (len(busy.received), home.callbacks()) == (2, {"delivered": 2})


@in_both_homes
def test_a_clock_that_is_put_right_while_a_worker_runs_keeps_no_delivery_waiting(stock, receiver, clock):
    home, busy = stock(), receiver(Receiver, 503, 204)
    sender = callbacks(home, clock)
    clock.goes_on(hours=6)
    ended(home, busy.url)
    look(sender)
    clock.goes_on(hours=-6)
    look(sender)
    clock.goes_on(seconds=ATTEMPT.total_seconds() + 1)
    look(sender)
    assert home.callbacks() == {"delivered": 1}
