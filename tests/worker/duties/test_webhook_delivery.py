import json
import socket
import threading
import time
from base64 import b64decode, b64encode
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from threading import Barrier

import pytest
import sqlalchemy as sa
from structlog.contextvars import merge_contextvars
from structlog.testing import capture_logs

from service.schemas.health import Alarms
from service.settings import Settings
from service.store import tables
from service.store.events.outbox import AT_ONCE_PER_RECEIVER
from service.store.jobs.queries import JobPage
from testbed.homes import in_both_homes
from testbed.stock import Stock, anyway
from tests.worker.certificates import certificate
from tests.worker.receiver import TELLTALE, Dripping, Endless, Receiver, Silent, Talkative, Telltale
from worker.duties import outbound_guard, webhook_request
from worker.duties.webhook_delivery import AT_ONCE, ATTEMPT, WebhookDelivery

pytestmark = pytest.mark.slow

SECRET, OTHER_SECRET = ("whsec_" + b64encode(bytes([n]) * 32).decode() for n in (7, 8))
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


@pytest.fixture
def receiver():
    """Starts receivers."""
    receivers = []

    def receiver(kind=Receiver, *statuses, **more):
        receivers.append(kind(*statuses, **more))
        return receivers[-1]

    yield receiver
    for one in receivers:
        one.close()


def callbacks(stock, clock) -> WebhookDelivery:
    return WebhookDelivery(stock.settings, stock.outbox, stock.jobs, stock.events, clock)


def look(sender: WebhookDelivery) -> None:
    """Look once, and wait for what comes of it."""
    sender.poll()
    sender.finish()


def ended(stock, url: str, **more) -> str:
    return stock.ended("v", datetime.now(UTC), callback_url=url, **more)


@in_both_homes
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


@in_both_homes
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
    home.venues.put(home.venue("v").model_copy(update={"alarms": rules}), anyway)
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
    home.venues.put(home.venue("w").model_copy(update={"alarms": rules}), anyway)
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


@in_both_homes
def test_a_cancelled_job_is_told_of_once(stock):
    home = stock()
    job = home.submitted("v", callback_url="https://example.com/")
    home.decisions.cancel(job)
    home.decisions.cancel(job)
    assert home.callbacks() == {"waiting": 1}


def test_signatures_are_those_of_standard_webhooks():
    # The example of the specification's own libraries.
    key = b64decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw")
    at = datetime.fromtimestamp(1614265330.9, UTC)
    assert webhook_request.headers("msg_p5jXN8AQM9LWM0D4loKWxJek", at, b'{"test": 2432232314}', [key]) == {
        "webhook-id": "msg_p5jXN8AQM9LWM0D4loKWxJek",
        "webhook-timestamp": "1614265330",
        "webhook-signature": "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=",
    }


def test_while_a_secret_is_replaced_both_sign(stock, receiver, clock):
    home, hook = stock(webhook_secret=f"{SECRET} {OTHER_SECRET}"), receiver()
    job = ended(home, hook.url)
    look(callbacks(home, clock))
    (told,) = hook.received
    each = [
        webhook_request.headers(job, clock.now, told.body, Settings(webhook_secret=secret).webhook_keys)
        for secret in (SECRET, OTHER_SECRET)
    ]
    assert told.headers.items() >= (each[0] | {"webhook-signature": told.headers["webhook-signature"]}).items()
    assert told.headers["webhook-signature"] == " ".join(one["webhook-signature"] for one in each)


# Again and again


@in_both_homes
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


@in_both_homes
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


@in_both_homes
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
    monkeypatch.setattr(webhook_request, "TIMEOUT_S", 3)
    home, slow, hook = stock(), receiver(Silent), receiver()
    # All of them were due before.
    names(monkeypatch, ["127.0.0.1"])
    for _ in range(3 * AT_ONCE):
        ended(home, f"http://slow.example:{slow.port}/")
    ended(home, hook.url)
    sender, begun = callbacks(home, clock), time.monotonic()
    while not hook.received:
        sender.poll()
        assert time.monotonic() - begun < 2
    assert len(slow.received) <= AT_ONCE_PER_RECEIVER
    sender.finish()


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


# Receivers that mean no good


@pytest.mark.parametrize("kind", [Silent, Dripping])
def test_no_receiver_holds_a_sender_longer_than_the_limit(stock, receiver, clock, monkeypatch, kind):
    # Enough for a busy machine to send it in, and nothing beside the hour for which they would hold on.
    monkeypatch.setattr(webhook_request, "TIMEOUT_S", 2)
    home, hook = stock(), receiver(kind)
    ended(home, hook.url)
    begun = time.monotonic()
    look(callbacks(home, clock))
    assert time.monotonic() - begun < 60
    assert (len(hook.received), home.callbacks()) == (1, {"waiting": 1})


@pytest.mark.parametrize("says", TELLTALE)
def test_nothing_that_a_receiver_says_is_read_through_a_callback(stock, receiver, clock, says):
    home, hook = stock(), receiver(Telltale)
    hook.says = says
    job = ended(home, hook.url)
    look(callbacks(home, clock))
    error = home.jobs.get(job).callback.last_error
    assert hook.received
    assert "hunter2" not in (error or "")
    assert "bytearray" not in (error or "")


def test_an_endless_answer_is_broken_off(stock, receiver, clock):
    home, hook = stock(), receiver(Endless, 200)
    ended(home, hook.url)
    look(callbacks(home, clock))
    assert home.callbacks() == {"delivered": 1}
    assert hook.broken_off.wait(10)


def test_redirects_are_not_followed(stock, receiver, clock):
    home, secret_place = stock(), receiver()
    hook = receiver(Receiver, 307, headers={"Location": secret_place.url})
    ended(home, hook.url)
    look(callbacks(home, clock))
    assert (len(hook.received), secret_place.received) == (1, [])
    assert home.callbacks() == {"waiting": 1}


def names(monkeypatch, *answers: list[str]) -> list[str]:
    """Let every name have these addresses, the last answer for ever; returns the list of names that were looked up."""
    asked, left = [], list(answers)

    def getaddrinfo(name, port, *_, **__):
        asked.append(name)
        answer = left.pop(0) if len(left) > 1 else left[0]
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port)) for address in answer]

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    return asked


def test_a_name_that_nobody_looks_up_holds_up_a_sender_for_seconds(stock, receiver, clock, monkeypatch):
    monkeypatch.setattr(outbound_guard, "LOOK_UP_S", 0.2)
    home, resolver = stock(), threading.Event()
    ended(home, "http://lame.example/")
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: resolver.wait(60) and [])
    sender, begun = callbacks(home, clock), time.monotonic()
    look(sender)
    resolver.set()
    assert time.monotonic() - begun < 30
    assert home.callbacks() == {"waiting": 1}
    (told,) = home.jobs.page(JobPage(1)).jobs
    assert told.callback.last_error == "lame.example cannot be looked up within 0.2 s"


def test_a_name_with_any_address_inside_is_not_called(stock, receiver, clock, monkeypatch):
    home, hook = stock(callback_allow_private=False), receiver()
    ended(home, f"http://rebound.example:{hook.port}/")
    names(monkeypatch, ["93.184.216.34", "127.0.0.1"])
    look(callbacks(home, clock))
    assert (hook.received, home.callbacks()) == ([], {"waiting": 1})


@pytest.mark.parametrize("allowed", ["127.0.0.0/8", "*.truck.lan"])
def test_a_private_receiver_is_called_if_the_operator_names_it_or_its_network(
    stock, receiver, clock, monkeypatch, allowed
):
    home, hook = stock(callback_allow_private=False, callbacks=[allowed]), receiver()
    ended(home, f"http://mixer.truck.lan:{hook.port}/")
    names(monkeypatch, ["127.0.0.1"])
    look(callbacks(home, clock))
    assert home.callbacks() == {"delivered": 1}


@pytest.mark.parametrize("allowed", ["10.2.0.0/24", "*.venue.lan"])
def test_no_other_private_receiver_is_called(stock, receiver, clock, monkeypatch, allowed):
    home, hook = stock(callback_allow_private=False, callbacks=[allowed]), receiver()
    job = ended(home, f"http://mixer.truck.lan:{hook.port}/")
    names(monkeypatch, ["10.2.0.7", "127.0.0.1"])
    look(callbacks(home, clock))
    assert hook.received == []
    assert "ESC_CALLBACKS does not name it" in home.jobs.get(job).callback.last_error


def test_the_connection_goes_to_the_address_that_was_checked(stock, receiver, clock, monkeypatch):
    home, hook = stock(), receiver()
    ended(home, f"http://rebound.example:{hook.port}/")
    asked = names(monkeypatch, ["127.0.0.1"], ["127.0.0.99"])
    look(callbacks(home, clock))
    assert hook.received[0].headers["host"] == f"rebound.example:{hook.port}"
    assert asked == ["rebound.example"]


def test_an_address_that_does_not_answer_is_passed_over_for_the_next(stock, receiver, clock, monkeypatch):
    home, hook = stock(), receiver()
    ended(home, f"http://two.example:{hook.port}/")
    names(monkeypatch, ["127.0.0.99", "127.0.0.1"])
    look(callbacks(home, clock))
    assert home.callbacks() == {"delivered": 1}


def test_proxies_of_the_environment_are_not_used(stock, receiver, clock, monkeypatch):
    home, hook, proxy = stock(), receiver(), receiver()
    monkeypatch.setenv("HTTP_PROXY", proxy.url)
    monkeypatch.setenv("ALL_PROXY", proxy.url)
    ended(home, hook.url)
    look(callbacks(home, clock))
    assert (len(hook.received), proxy.received) == (1, [])


@pytest.mark.parametrize(("name", "told"), [("hook.example", 1), ("other.example", 0)])
def test_the_certificate_is_checked_against_the_name(stock, receiver, clock, monkeypatch, tmp_path, name, told):
    home, hook = stock(), receiver(certificate=certificate(tmp_path, "hook.example"))
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "certificate.pem"))
    names(monkeypatch, ["127.0.0.1"])
    ended(home, f"https://{name}:{hook.port}/")
    look(callbacks(home, clock))
    assert len(hook.received) == told
