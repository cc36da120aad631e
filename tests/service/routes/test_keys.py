"""Keys that an administrator manages by HTTP."""

from datetime import UTC, datetime, timedelta

import pytest

from service.settings import Settings
from testbed.homes import Embedded
from tests.service.local_service import LocalService


@pytest.fixture
def guarded(tmp_path):
    """A service of its own, which nobody has a key of yet."""
    Embedded().make_database(tmp_path)
    with LocalService(Settings(data=tmp_path)) as service:
        yield service


@pytest.fixture
def admin(guarded):
    return called_with(guarded.context.keys.add("ops", "admin"))


def called_with(key):
    return {"Authorization": f"Bearer {key}"}


def kind(answer):
    return answer.json()["type"].rpartition("/")[2]


def test_an_administrator_makes_a_key_that_works_and_revokes_it(guarded, admin):
    until = datetime.now(UTC).replace(microsecond=0) + timedelta(days=1)
    wanted = {"name": "truck-7", "scope": "calibrate", "venue_ids": ["one", "one"], "expires_at": until.isoformat()}
    made = guarded.http.post("/keys", json=wanted, headers=admin)
    assert made.status_code == 201
    assert made.json()["name"] == "truck-7"
    theirs = called_with(made.json()["key"])
    assert guarded.http.get("/venues", headers=theirs).status_code == 200
    assert kind(guarded.http.get("/venues/another", headers=theirs)) == "venue-not-found"

    listed = guarded.http.get("/keys", headers=admin)
    assert made.json()["key"] not in listed.text
    ops, truck = listed.json()["keys"]
    assert (ops["name"], ops["venue_ids"], ops["expires_at"]) == ("ops", None, None)
    assert (truck["scope"], truck["venue_ids"]) == ("calibrate", ["one"])
    assert datetime.fromisoformat(truck["expires_at"]) == until

    assert kind(guarded.http.post("/keys", json=wanted, headers=admin)) == "key-exists"
    assert guarded.http.delete("/keys/truck-7", headers=admin).status_code == 204
    assert kind(guarded.http.delete("/keys/truck-7", headers=admin)) == "key-not-found"
    assert [key.name for key in guarded.context.keys.all()] == ["ops"]


def test_nobody_else_manages_keys(guarded):
    wanted = {"name": "mine", "scope": "admin"}
    # Where no key is asked for, the first one is made on the machine itself.
    assert kind(guarded.http.post("/keys", json=wanted)) == "key-missing"
    assert kind(guarded.http.get("/keys")) == "key-missing"


@pytest.mark.parametrize(
    ("scope", "venues", "expected"),
    [("calibrate", None, "scope-too-small"), ("admin", ["one"], "key-for-some-venues")],
)
def test_a_key_of_less_manages_none(guarded, scope, venues, expected):
    less = called_with(guarded.context.keys.add("less", scope, None, venues))
    assert kind(guarded.http.post("/keys", json={"name": "more", "scope": "admin"}, headers=less)) == expected
    assert kind(guarded.http.get("/keys", headers=less)) == expected
    assert kind(guarded.http.delete("/keys/less", headers=less)) == expected


def test_a_key_does_not_revoke_itself(guarded, admin):
    assert kind(guarded.http.delete("/keys/ops", headers=admin)) == "key-in-use"
    assert [key.name for key in guarded.context.keys.all()] == ["ops"]


@pytest.mark.parametrize(
    "wanted",
    [
        {"name": "Bad name", "scope": "read"},
        {"name": "one", "scope": "everything"},
        {"name": "one", "scope": "read", "venue_ids": []},
        {"name": "one", "scope": "read", "expires_at": 0},
        {"name": "one", "scope": "read", "expires_at": "2030-01-01T00:00:00"},
    ],
)
def test_what_is_no_key_is_refused(guarded, admin, wanted):
    assert kind(guarded.http.post("/keys", json=wanted, headers=admin)) == "invalid-request"
