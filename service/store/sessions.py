"""Browser sessions and the keys that they began with. A hash is stored; the token itself is in a cookie."""

import secrets
from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from service.store.database import Repository, reading, writing
from service.store.keys import Key, hash_of, key_in
from service.store.tables import api_keys, sessions

s = sessions.c


class SessionRepository(Repository):
    """The sessions in the database."""

    def begin(self, key: Key, lasts: timedelta) -> str:
        """Begin a session of the owner of a key and return its token. Those that are over are forgotten."""
        token, now = secrets.token_urlsafe(32), datetime.now(UTC)
        with writing(self._engine) as connection:
            connection.execute(sa.delete(sessions).where(s.expires_at <= now))
            values = {"hash": hash_of(token), "key_hash": key.hash, "expires_at": now + lasts}
            connection.execute(sa.insert(sessions).values(**values))
        return token

    def key_of(self, hash_: str) -> Key | None:
        """Return the key that the session with this hash began with; None if either has ended."""
        query = (
            sa.select(api_keys)
            .join(sessions, s.key_hash == api_keys.c.hash)
            .where(s.hash == hash_, s.expires_at > datetime.now(UTC))
        )
        with reading(self._engine) as connection:
            row = connection.execute(query).one_or_none()
        return None if row is None else key_in(row)

    def end(self, hash_: str) -> None:
        """Forget a session."""
        with writing(self._engine) as connection:
            connection.execute(sa.delete(sessions).where(s.hash == hash_))
