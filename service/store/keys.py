"""API keys: how they are made, and all SQL about them. What is stored is a hash; the key itself is seen once."""

import hashlib
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.schemas.names import Scope
from service.schemas.problems import Problem
from service.store.database import Repository, advisory_lock, reading, writing
from service.store.tables import api_keys

PREFIX = "esc_"
LONGEST_NAME, OLD = 64, "-old"
# Seconds for which a service goes on taking a key as it was when it last looked.
KEY_CACHED_FOR_S = 5.0
k = api_keys.c


@dataclass(frozen=True)
class Key:
    """An API key, without the key itself."""

    name: str
    hash: str
    scope: Scope
    created_at: datetime
    expires_at: datetime | None
    last_used_at: datetime | None
    # Ids of the venues that it is for; None: all.
    venues: frozenset[str] | None = None

    def is_for(self, venue_id: str | None) -> bool:
        """True if the key gives access to a venue; what belongs to none (None) is for keys of all venues only."""
        return self.venues is None or venue_id in self.venues

    @property
    def expired(self) -> bool:
        """True if the key has expired."""
        return self.expires_at is not None and self.expires_at <= datetime.now(UTC)


def new_key() -> str:
    """Return a new key: 256 random bits behind a prefix that people, and scanners for leaked secrets, recognise."""
    return PREFIX + secrets.token_urlsafe(32)


def hash_of(key: str) -> str:
    """Return the SHA-256 of a key, which is stored and looked up.

    Slow and salted hashes are for passwords, which people choose and others guess. Nobody guesses 256 random bits, so a
    fast hash gives nothing away, and it can be looked up: how long that takes depends on the hash of what was sent,
    which nobody can steer, and tells nothing about a key.
    """
    return hashlib.sha256(key.encode()).hexdigest()


def old_name(name: str) -> str:
    """Return the name of a key after its rotation, another one that is no longer than names may be."""
    old = f"{name[: LONGEST_NAME - len(OLD)]}{OLD}"
    return old if old != name else f"{name[: LONGEST_NAME - 2 * len(OLD)]}{OLD}{OLD}"


class KeyRepository(Repository):
    """The keys in the database."""

    def add(
        self, name: str, scope: Scope, expires_at: datetime | None = None, venues: Collection[str] | None = None
    ) -> str:
        """Make a key and return it: the only time that it can be seen. `venues`: it is for no others; None: for all.

        Raises the problem `key-exists`.
        """
        key = new_key()
        with writing(self._engine) as connection:
            advisory_lock(connection, "keys")
            if connection.scalar(sa.select(k.name).where(k.name == name)) is not None:
                raise Problem("key-exists", f"Revoke {name} first, or take another name.")
            connection.execute(
                sa.insert(api_keys).values(
                    name=name,
                    hash=hash_of(key),
                    scope=scope,
                    created_at=datetime.now(UTC),
                    expires_at=expires_at,
                    venues=None if venues is None else sorted(set(venues)),
                )
            )
        return key

    def rotate(self, name: str, grace: timedelta) -> str | None:
        """Make a new key of the same name, scope, venues and end, and return it; None: there is no key of this name.

        The old one goes on under the name with `-old` until the grace is over; one that was still there is forgotten.
        """
        key, old = new_key(), old_name(name)
        with writing(self._engine) as connection:
            advisory_lock(connection, "keys")
            row = connection.execute(sa.select(api_keys).where(k.name == name)).one_or_none()
            if row is None:
                return None
            now = datetime.now(UTC)
            until = now + grace if row.expires_at is None else min(row.expires_at, now + grace)
            connection.execute(sa.delete(api_keys).where(k.name == old))
            connection.execute(sa.update(api_keys).where(k.name == name).values(name=old, expires_at=until))
            same = {"scope": row.scope, "expires_at": row.expires_at, "venues": row.venues}
            new = {"name": name, "hash": hash_of(key), "created_at": now}
            connection.execute(sa.insert(api_keys).values(**new, **same))
        return key

    def remove(self, name: str) -> bool:
        """Forget a key; says whether it was there."""
        with writing(self._engine) as connection:
            return connection.execute(sa.delete(api_keys).where(k.name == name)).rowcount == 1

    def all(self) -> list[Key]:
        """Return all keys, by name."""
        with reading(self._engine) as connection:
            return [key_in(row) for row in connection.execute(sa.select(api_keys).order_by(k.name))]

    def any(self) -> bool:
        """True if there is a key. An expired one counts: time alone must not open a service."""
        with reading(self._engine) as connection:
            return connection.scalar(sa.select(k.name).limit(1)) is not None

    def find(self, hash_: str) -> Key | None:
        """Return the key with this hash, or None."""
        with reading(self._engine) as connection:
            row = connection.execute(sa.select(api_keys).where(k.hash == hash_)).one_or_none()
        return None if row is None else key_in(row)

    def note_uses(self, last: Mapping[str, datetime]) -> None:
        """Write down when keys, by their hashes, were last used; another process may have noted a later use."""
        earlier = sa.or_(k.last_used_at.is_(None), k.last_used_at < sa.bindparam("at"))
        update = sa.update(api_keys).where(k.hash == sa.bindparam("of"), earlier)
        with writing(self._engine) as connection:
            connection.execute(
                update.values(last_used_at=sa.bindparam("at")), [{"of": hash_, "at": at} for hash_, at in last.items()]
            )


def key_in(row: Any) -> Key:
    """Return the key in a row of the table."""
    venues = None if row.venues is None else frozenset(row.venues)
    return Key(row.name, row.hash, row.scope, row.created_at, row.expires_at, row.last_used_at, venues)
