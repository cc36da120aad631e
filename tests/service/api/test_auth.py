"""Authentication with a real database and a clock that the tests set."""

import asyncio
from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa
from fastapi import APIRouter
from starlette.requests import HTTPConnection
from structlog.testing import capture_logs

from service.api.auth import COOKIE, GUESS_EVERY_S, GUESSES, Authenticator, page_token
from service.routes.contract.guarded import Guarded
from service.schemas.problems import Problem
from service.settings import Settings
from service.store.keys import KEY_CACHED_FOR_S, KeyRepository, hash_of
from service.store.sessions import SessionRepository
from tests.service.api.test_rate_limit import Clock

pytestmark = pytest.mark.slow

JUST_BEFORE, JUST_AFTER = KEY_CACHED_FOR_S - 0.1, KEY_CACHED_FOR_S + 0.1
# `esc calibrate --wait` asks so often for a job.
FOLLOWS_PER_S = 2


@pytest.fixture
def keys(engine):
    return KeyRepository(engine)


@pytest.fixture
def sessions(engine):
    return SessionRepository(engine)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def gate(keys, sessions, clock):
    """Authenticator of a service that listens on loopback."""
    return Authenticator(keys, sessions, Settings(), clock)


def caller(key=None, address="192.0.2.1", scheme="Bearer", method="GET", **others):
    """A request, with headers as named."""
    sent = {"host": "localhost", **others} | ({} if key is None else {"authorization": f"{scheme} {key}"})
    headers = [(name.replace("_", "-").encode(), value.encode()) for name, value in sent.items()]
    return HTTPConnection({"type": "http", "method": method, "headers": headers, "client": (address, 50000)})


def answer(gate, key=None, needed="read", **more):
    """`passed`, or the problem that says why not."""
    try:
        asyncio.run(gate.admit(caller(key, **more), needed))
    except Problem as problem:
        return problem
    return "passed"


def kind(*arguments, **more):
    problem = answer(*arguments, **more)
    return problem if problem == "passed" else problem.kind


def test_on_loopback_anyone_may_call_until_there_is_a_key(gate, keys, clock):
    assert kind(gate, needed="admin") == "passed"
    key = keys.add("ops", "admin")
    clock.now += JUST_AFTER
    assert kind(gate) == "key-missing"
    assert kind(gate, key, "admin") == "passed"


def test_a_service_that_asked_for_keys_goes_on_asking_when_the_last_one_is_removed(gate, keys, clock):
    keys.add("ops", "admin")
    assert kind(gate) == "key-missing"
    keys.remove("ops")
    clock.now += 3600
    assert kind(gate) == "key-missing"


def test_beyond_this_machine_a_key_is_needed_even_if_there_is_none(keys, sessions):
    assert kind(Authenticator(keys, sessions, Settings(host="0.0.0.0"))) == "key-missing"


def test_switched_off_it_asks_for_nothing(keys, sessions):
    keys.add("ops", "admin")
    assert kind(Authenticator(keys, sessions, Settings(host="0.0.0.0", auth="off")), needed="admin") == "passed"


@pytest.mark.parametrize(
    ("scope", "allowed"), [("read", 1), ("calibrate", 2), ("admin", 3)], ids=["read", "calibrate", "admin"]
)
def test_a_scope_includes_the_smaller_ones(gate, keys, scope, allowed):
    key = keys.add("k", scope)
    answers = [kind(gate, key, needed) for needed in ("read", "calibrate", "admin")]
    assert answers == ["passed"] * allowed + ["scope-too-small"] * (3 - allowed)


def test_who_may_not_is_told_what_it_takes(gate, keys):
    problem = answer(gate, keys.add("cron", "calibrate"), "admin")
    assert problem.members()["detail"] == "This needs a key of scope admin; cron has calibrate."
    assert problem.headers["WWW-Authenticate"] == 'Bearer error="insufficient_scope", scope="admin"'


@pytest.mark.parametrize("sent", ["", " ", "Basic b3BzOm9wcw=="])
def test_what_is_no_bearer_token_is_no_key(gate, keys, sent):
    keys.add("ops", "admin")
    scheme, _, token = sent.partition(" ")
    assert kind(gate, token, scheme=scheme) == "key-missing"


def test_the_scheme_may_be_written_in_any_case(gate, keys):
    assert kind(gate, keys.add("ops", "admin"), scheme="bearer") == "passed"


def test_a_removed_key_works_for_seconds_and_no_longer(gate, keys, clock):
    key, _ = keys.add("cron", "read"), keys.add("ops", "admin")
    assert kind(gate, key) == "passed"
    keys.remove("cron")
    clock.now += JUST_BEFORE
    assert kind(gate, key) == "passed"
    clock.now += 0.2
    assert kind(gate, key) == "key-unknown"


def test_an_expired_key_is_refused_to_the_second_and_told_so(gate, keys, monkeypatch):
    key = keys.add("guest", "read", datetime.now(UTC) + timedelta(days=1))
    assert kind(gate, key) == "passed"
    late = type("Late", (datetime,), {"now": lambda zone: datetime.now(zone) + timedelta(days=1)})
    monkeypatch.setattr("service.store.keys.datetime", late)
    problem = answer(gate, key)
    assert (problem.kind, "guest was good until" in problem.detail) == ("key-expired", True)


def test_polling_neither_reads_nor_writes_the_database(gate, keys, engine):
    key = keys.add("cron", "read")
    assert kind(gate, key) == "passed"
    statements = []
    sa.event.listen(engine, "before_cursor_execute", lambda *arguments: statements.append(arguments[2]))
    assert {kind(gate, key) for _ in range(100)} == {"passed"}
    assert statements == []
    assert keys.all()[0].last_used_at is None
    asyncio.run(gate.write_uses())
    assert datetime.now(UTC) - keys.all()[0].last_used_at < timedelta(minutes=1)


def test_uses_are_remembered_while_the_database_is_away(gate, keys, monkeypatch):
    key = keys.add("cron", "read")
    assert kind(gate, key) == "passed"
    with monkeypatch.context() as patch, capture_logs() as logs:
        patch.setattr(keys, "note_uses", lambda _: 1 / 0)
        asyncio.run(gate.write_uses())
    assert [entry["event"] for entry in logs] == ["cannot write down when keys were used"]
    asyncio.run(gate.write_uses())
    assert keys.all()[0].last_used_at is not None


def test_a_key_that_asks_too_often_is_told_when_to_come_back(keys, sessions, clock):
    gate = Authenticator(keys, sessions, Settings(rate_per_s=0.5, rate_burst=3), clock)
    hasty, other = keys.add("hasty", "read"), keys.add("other", "read")
    assert [kind(gate, hasty) for _ in range(3)] == ["passed"] * 3
    problem = answer(gate, hasty)
    assert (problem.kind, problem.headers) == ("rate-limited", {"Retry-After": "2"})
    assert kind(gate, other) == "passed"
    clock.now += 2
    assert kind(gate, hasty) == "passed"


def test_following_every_job_that_can_be_open_stays_below_the_limit():
    settings = Settings()
    assert settings.rate_per_s > FOLLOWS_PER_S * (settings.queue_limit + settings.jobs_at_once)


def test_keys_cannot_be_guessed_quickly(gate, keys, clock):
    keys.add("ops", "admin")
    assert [kind(gate, f"esc_{number}") for number in range(GUESSES)] == ["key-unknown"] * GUESSES
    problem = answer(gate, "esc_x")
    assert problem.kind == "too-many-unknown-keys"
    assert 1 <= int(problem.headers["Retry-After"]) <= GUESS_EVERY_S
    assert kind(gate, "esc_x", address="192.0.2.2") == "key-unknown"
    clock.now += GUESS_EVERY_S
    assert kind(gate, "esc_x") == "key-unknown"
    assert kind(gate, "esc_x") == "too-many-unknown-keys"


def test_a_key_in_use_is_not_held_up_by_guesses_from_its_address(gate, keys, clock):
    key = keys.add("cron", "read")
    assert kind(gate, key) == "passed"
    for number in range(GUESSES + 5):
        answer(gate, f"esc_{number}")
    assert kind(gate, "esc_x") == "too-many-unknown-keys"
    clock.now += JUST_AFTER
    assert kind(gate, key) == "passed"


def test_keys_that_are_guessed_at_once_are_looked_up_no_more_often(gate, keys, clock, monkeypatch):
    keys.add("ops", "admin")
    assert kind(gate) == "key-missing"
    looked_up, find = [], keys.find
    monkeypatch.setattr(keys, "find", lambda hash_: looked_up.append(hash_) or find(hash_))

    async def guess():
        calls = [gate.admit(caller(f"esc_{number}"), "read") for number in range(10 * GUESSES)]
        return await asyncio.gather(*calls, return_exceptions=True)

    refused = [problem.kind for problem in asyncio.run(guess())]
    assert (len(looked_up), refused.count("key-unknown")) == (GUESSES, GUESSES)
    # Nor is anybody locked out for longer by them.
    clock.now += GUESS_EVERY_S
    assert kind(gate, "esc_x") == "key-unknown"


def test_keys_that_are_known_use_up_no_guesses(gate, keys):
    known = [keys.add(f"cron-{number}", "read") for number in range(2 * GUESSES)]
    assert {kind(gate, key) for key in known} == {"passed"}


def test_a_database_that_is_away_uses_up_no_guesses(gate, keys, monkeypatch):
    key = keys.add("cron", "read")
    with monkeypatch.context() as patch:
        patch.setattr(keys, "find", lambda _: 1 / 0)
        for _ in range(2 * GUESSES):
            with pytest.raises(ZeroDivisionError):
                asyncio.run(gate.admit(caller(key), "read"))
    assert kind(gate, key) == "passed"


def test_addresses_of_one_ipv6_network_guess_together(gate, keys):
    keys.add("ops", "admin")
    for number in range(GUESSES):
        assert kind(gate, "esc_x", address=f"2001:db8::{number}") == "key-unknown"
    assert kind(gate, "esc_x", address="2001:db8::ffff") == "too-many-unknown-keys"
    assert kind(gate, "esc_x", address="2001:db8:0:1::1") == "key-unknown"


def test_a_refused_key_is_not_in_the_log(gate, keys):
    keys.add("ops", "admin")
    with capture_logs() as logs:
        answer(gate, "esc_secret")
    assert logs == [{"event": "unknown key", "address": "192.0.2.1", "log_level": "warning"}]


def test_a_route_that_does_not_say_who_may_call_it_cannot_be_made():
    with pytest.raises(TypeError, match="/new must say who may call it"):
        APIRouter(route_class=Guarded).get("/new")(lambda: None)


@pytest.fixture
def signed_in(gate, keys):
    """The cookie of somebody who signed in with a key that may calibrate."""
    key = keys.add("olga", "calibrate")
    return asyncio.run(gate.sign_in(caller(), key))


def with_cookie(gate, session, needed="read", **more):
    return kind(gate, needed=needed, cookie=f"{COOKIE}={session}", **more)


def test_who_signed_in_may_do_what_the_key_may(gate, signed_in):
    assert with_cookie(gate, signed_in) == "passed"
    assert with_cookie(gate, signed_in, "admin") == "scope-too-small"


def test_what_changes_something_needs_the_token_of_the_page_as_well(gate, signed_in):
    token = page_token(signed_in)
    assert with_cookie(gate, signed_in, "calibrate", method="POST") == "token-missing"
    assert with_cookie(gate, signed_in, "calibrate", method="POST", x_csrf_token="0" * 64) == "token-missing"
    assert with_cookie(gate, signed_in, "calibrate", method="POST", x_csrf_token=token) == "passed"


def test_a_session_ends_with_its_time(gate, keys, sessions, clock):
    session = sessions.begin(keys.find(hash_of(keys.add("olga", "read"))), timedelta(seconds=-1))
    assert with_cookie(gate, session) == "session-over"


def test_a_session_ends_when_its_owner_signs_out(gate, signed_in):
    assert with_cookie(gate, signed_in) == "passed"
    asyncio.run(gate.sign_out(caller(cookie=f"{COOKIE}={signed_in}")))
    assert with_cookie(gate, signed_in) == "session-over"


def test_a_session_ends_with_its_key(gate, keys, signed_in, clock):
    keys.add("another", "admin")
    keys.remove("olga")
    assert with_cookie(gate, signed_in) == "session-over"


def test_nobody_signs_in_with_what_is_no_key(gate, keys):
    keys.add("ops", "admin")
    with pytest.raises(Problem) as refused:
        asyncio.run(gate.sign_in(caller(), "esc_guessed"))
    assert refused.value.kind == "key-unknown"


def test_what_is_stored_of_a_session_does_not_open_the_door(gate, engine, signed_in):
    with engine.connect() as connection:
        (stored,) = connection.scalars(sa.text("SELECT hash FROM sessions"))
    assert with_cookie(gate, stored) == "session-over"


def test_sessions_cannot_be_guessed_quickly(gate, keys, sessions, monkeypatch):
    keys.add("ops", "admin")
    looked_up, key_of = [], sessions.key_of
    monkeypatch.setattr(sessions, "key_of", lambda hash_: looked_up.append(hash_) or key_of(hash_))
    with capture_logs() as logs:
        answers = [with_cookie(gate, f"guess-{number}") for number in range(30 * GUESSES)]
    assert answers == ["session-over"] * GUESSES + ["too-many-unknown-keys"] * 29 * GUESSES
    assert len(looked_up) == GUESSES
    guess = {"event": "unknown key", "address": "192.0.2.1", "sent_as": "cookie", "log_level": "warning"}
    assert logs == [guess] * GUESSES
    # Keys are guessed from the same address.
    assert kind(gate, "esc_x") == "too-many-unknown-keys"
    assert kind(gate, "esc_x", address="192.0.2.2") == "key-unknown"


def test_a_page_that_goes_on_asking_after_its_session_guesses_nothing(gate, keys, sessions, signed_in, clock):
    key = keys.add("other", "read")
    sessions.end(hash_of(signed_in))
    assert {with_cookie(gate, signed_in) for _ in range(10 * GUESSES)} == {"session-over"}
    # Whoever sits there can sign in again at once.
    assert asyncio.run(gate.sign_in(caller(), key))


def test_who_is_signed_in_is_not_held_up_by_guesses_from_the_same_address(gate, signed_in, clock):
    assert with_cookie(gate, signed_in) == "passed"
    for number in range(2 * GUESSES):
        with_cookie(gate, f"guess-{number}")
    clock.now += JUST_AFTER
    assert with_cookie(gate, signed_in) == "passed"
