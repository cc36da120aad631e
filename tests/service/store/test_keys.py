import re
from datetime import UTC, datetime, timedelta

import pytest

from service.schemas.problems import Problem
from service.store.keys import LONGEST_NAME, KeyRepository, hash_of, old_name
from testbed.homes import in_both_homes

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


@pytest.fixture
def keys(engine):
    return KeyRepository(engine)


def test_a_key_is_256_random_bits_behind_a_prefix(keys):
    made = [keys.add(name, "read") for name in ("a", "b")]
    assert made[0] != made[1]
    assert all(re.fullmatch(r"esc_[A-Za-z0-9_-]{43}", key) for key in made)


def test_on_the_disk_there_is_the_hash_and_nowhere_the_key(keys, tmp_path):
    key = keys.add("cron", "calibrate")
    kept = b"".join(file.read_bytes() for file in tmp_path.iterdir())
    assert hash_of(key).encode() in kept
    assert key.encode() not in kept
    assert key.removeprefix("esc_").encode() not in kept


@in_both_homes
def test_a_key_is_found_until_it_is_removed(keys):
    key = keys.add("cron", "calibrate", NOON)
    found = keys.find(hash_of(key))
    assert (found.name, found.scope, found.expires_at, found.last_used_at) == ("cron", "calibrate", NOON, None)
    assert keys.find(hash_of(key + "x")) is None
    assert keys.remove("cron")
    assert keys.find(hash_of(key)) is None
    assert not keys.remove("cron")


@in_both_homes
def test_a_name_is_of_one_key(keys):
    keys.add("cron", "read")
    with pytest.raises(Problem, match="Revoke cron first"):
        keys.add("cron", "admin")
    assert [key.scope for key in keys.all()] == ["read"]


def test_an_expired_key_is_still_a_key(keys):
    assert not keys.any()
    keys.add("old", "read", datetime.now(UTC) - timedelta(seconds=1))
    assert keys.any()
    assert keys.all()[0].expired


def test_a_key_that_is_rotated_ends_no_later_than_it_would_have(keys):
    end = datetime.now(UTC) + timedelta(hours=1)
    keys.add("cron", "read", end)
    keys.rotate("cron", timedelta(days=1))
    assert [(key.name, key.expires_at) for key in keys.all()] == [("cron", end), ("cron-old", end)]


@pytest.mark.parametrize("name", ["cron", "c" * 62, "c" * 64, "c" * 58 + "-old", "c" * 60 + "-old"])
def test_the_old_key_works_on_under_another_name_whatever_the_name(keys, name):
    key = keys.add(name, "read")
    for _ in range(2):
        new = keys.rotate(name, timedelta(days=1))
        assert {keys.find(hash_of(key)).name, keys.find(hash_of(new)).name} == {name, old_name(name)}
        assert len(old_name(name)) <= LONGEST_NAME
        key = new


@in_both_homes
def test_a_use_that_another_process_noted_later_stays(keys):
    of = {name: hash_of(keys.add(name, "read")) for name in ("a", "b")}
    keys.note_uses({of["a"]: NOON + timedelta(minutes=1)})
    keys.note_uses({of["a"]: NOON, of["b"]: NOON, hash_of("a key removed since"): NOON})
    assert [key.last_used_at for key in keys.all()] == [NOON + timedelta(minutes=1), NOON]
