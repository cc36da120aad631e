"""Authentication of callers: API keys, their scopes and their rates.

A program sends its key with each request. A person signs in with one: from then on the browser sends a cookie, and with
what changes something the token that only our own pages can read (a page of another site could have the cookie sent
along, were it not for SameSite as well).

A key that was found is cached for a few seconds without another look at the database, so that polling costs a hash and
two look-ups in memory. That is how long a removed key still opens the door, in each API process; what is being
answered then (a long poll, a stream of events) is answered to its end. Reading never writes: uses are remembered and
written down once a minute.
"""

import asyncio
import hashlib
import hmac
import ipaddress
import math
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import get_args

import structlog
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from service.api import origins
from service.api.rate_limit import TokenBuckets
from service.schemas.addresses import ip_of
from service.schemas.names import Scope
from service.schemas.problems import Problem
from service.settings import Settings
from service.store.keys import KEY_CACHED_FOR_S, Key, KeyRepository, hash_of
from service.store.sessions import SessionRepository

COOKIE, TOKEN_HEADER = "esc_session", "X-CSRF-Token"
USES_WRITTEN_EVERY_S = 60.0
# Unknown keys and cookies from one address: so many at once, then one every so many seconds.
GUESSES = 10
GUESS_EVERY_S = 6.0
# Cookies of no session; older ones are looked up again.
MOST_UNKNOWN_SESSIONS = 10_000
SCOPES: tuple[Scope, ...] = get_args(Scope)
log = structlog.get_logger()


@dataclass(frozen=True)
class _CachedKey:
    key: Key
    until: float


def missing_scope(key: Key | None, needed: Scope) -> Problem | None:
    """Return the problem of a key that lacks a scope; None if it has it, or the service asks for no keys."""
    if key is None or SCOPES.index(key.scope) >= SCOPES.index(needed):
        return None
    return Problem(
        "scope-too-small",
        f"This needs a key of scope {needed}; {key.name} has {key.scope}.",
        headers={"WWW-Authenticate": f'Bearer error="insufficient_scope", scope="{needed}"'},
        expected=needed,
        got=key.scope,
    )


class Authenticator:
    """Authenticates callers by API key or session cookie, and checks scope and rate (RFC 6750)."""

    def __init__(
        self,
        keys: KeyRepository,
        sessions: SessionRepository,
        settings: Settings,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._keys = keys
        self._sessions = sessions
        self._settings = settings
        self._clock = clock
        self._off = settings.auth == "off"
        # Once on it stays on, or the service would be open while the only key is being exchanged.
        self._on = settings.listens_beyond_this_machine
        self._next_key_check_at = -math.inf
        self._cached_keys: dict[str, _CachedKey] = {}
        self._cached_sessions: dict[str, _CachedKey] = {}
        # Hashes of cookies that belong to no session and never will: pages that go on sending an old one guess nothing.
        self._unknown_sessions: OrderedDict[str, None] = OrderedDict()
        self._uses: dict[str, datetime] = {}
        self._requests = TokenBuckets(settings.rate_per_s, settings.rate_burst, clock=clock)
        self._guesses = TokenBuckets(1 / GUESS_EVERY_S, GUESSES, clock=clock)

    async def admit(self, request: HTTPConnection, needed: Scope) -> Key | None:
        """Return the caller's key, None if the service asks for none; raises the problem that says why not."""
        if not await self.asks_for_keys():
            origins.check(request, self._settings)
            return None
        key = await self._key(request)
        # Every line that the request leaves in the log.
        structlog.contextvars.bind_contextvars(key=key.name)
        self._count_request(key)
        if problem := missing_scope(key, needed):
            raise problem
        return key

    async def sign_in(self, request: HTTPConnection, given: str) -> str:
        """Begin a session with a key; return the value of its cookie."""
        key = await self._of_bearer(given, _client_address(request))
        return await run_in_threadpool(self._sessions.begin, key, timedelta(hours=self._settings.session_hours))

    async def sign_out(self, request: HTTPConnection) -> None:
        """End the session of a request, if it has one."""
        hash_ = hash_of(request.cookies.get(COOKIE, ""))
        self._cached_sessions.pop(hash_, None)
        await run_in_threadpool(self._sessions.end, hash_)

    async def run(self) -> None:
        """Write uses of keys to the database every minute, until cancelled."""
        while True:
            await asyncio.sleep(USES_WRITTEN_EVERY_S)
            await self.write_uses()

    async def write_uses(self) -> None:
        """Write to the database which keys were used since the last call."""
        uses, self._uses = self._uses, {}
        if not uses:
            return
        try:
            await run_in_threadpool(self._keys.note_uses, uses)
        except Exception:  # the database is away for a moment: the next time will do
            log.warning("cannot write down when keys were used", exc_info=True)
            self._uses = uses | self._uses

    async def asks_for_keys(self) -> bool:
        """True if callers need a key."""
        if self._off:
            return False
        now = self._clock()
        if not self._on and now >= self._next_key_check_at:
            self._on = await run_in_threadpool(self._keys.any)
            self._next_key_check_at = now + KEY_CACHED_FOR_S
        return self._on

    async def _key(self, request: HTTPConnection) -> Key:
        """Return the caller's key from the bearer token (RFC 6750) or the session cookie."""
        scheme, _, given = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and given:
            return await self._of_bearer(given, _client_address(request))
        if COOKIE in request.cookies:
            return await self._of_session(request, request.cookies[COOKIE])
        raise Problem(
            "key-missing",
            "Send one as `Authorization: Bearer esc_...`; `esc key add` on the machine of the service makes one.",
            headers={"WWW-Authenticate": "Bearer"},
        )

    async def _of_bearer(self, given: str, address: str) -> Key:
        hash_ = hash_of(given.strip())
        cached = self._cached_keys.get(hash_)
        if cached is None:
            # A key that was never seen before may be a guess.
            key = await self._guessed(address, lambda: self._find(hash_, address))
        elif cached.until <= self._clock():
            key = await self._find(hash_, address)
        else:
            key = cached.key
        return _unexpired(key)

    async def _of_session(self, request: HTTPConnection, token: str) -> Key:
        changes = request.scope["method"] not in origins.READING
        if changes and not hmac.compare_digest(
            request.headers.get(TOKEN_HEADER, "").encode(), page_token(token).encode()
        ):
            raise Problem("token-missing", f"Load the page again: it sends {TOKEN_HEADER} with what it changes.")
        hash_ = hash_of(token)
        cached = self._cached_sessions.get(hash_)
        if cached is not None and self._clock() < cached.until:
            return _unexpired(cached.key)
        if hash_ in self._unknown_sessions:
            raise _session_over()
        if cached is None:
            address = _client_address(request)
            return _unexpired(await self._guessed(address, lambda: self._find_session(hash_, address)))
        return _unexpired(await self._find_session(hash_))

    async def _find_session(self, hash_: str, guessed_from: str | None = None) -> Key:
        """Return the key of a session; `guessed_from`: the address of a client whose cookie was never seen before."""
        until = self._clock() + KEY_CACHED_FOR_S
        key = await run_in_threadpool(self._sessions.key_of, hash_)
        if key is None:
            self._cached_sessions.pop(hash_, None)
            self._unknown_sessions[hash_] = None
            if len(self._unknown_sessions) > MOST_UNKNOWN_SESSIONS:
                self._unknown_sessions.popitem(last=False)
            if guessed_from is not None:
                log.warning("unknown key", address=guessed_from, sent_as="cookie")
            raise _session_over()
        self._cached_sessions[hash_] = _CachedKey(key, until)
        return key

    async def _guessed(self, address: str, find: Callable[[], Awaitable[Key]]) -> Key:
        """Return the key that `find` finds, unless too much was guessed from this address."""
        wait_s = self._guesses.wait_s(address)
        if wait_s:
            raise Problem(
                "too-many-unknown-keys", "See that the key is right, then try again.", headers=_retry_after(wait_s)
            )
        # Before the look, or any number of guesses that come at once would all be looked up.
        self._guesses.take(address)
        guessed = False
        try:
            return await find()
        except Problem:
            guessed = True
            raise
        finally:
            if not guessed:
                self._guesses.give_back(address)

    async def _find(self, hash_: str, address: str) -> Key:
        until = self._clock() + KEY_CACHED_FOR_S
        key = await run_in_threadpool(self._keys.find, hash_)
        if key is None:
            self._cached_keys.pop(hash_, None)
            log.warning("unknown key", address=address)
            raise _invalid_key(
                "key-unknown", "It was removed, or is of another service; `esc key list` names those of this."
            )
        self._cached_keys[hash_] = _CachedKey(key, until)
        return key

    def _count_request(self, key: Key) -> None:
        wait_s = self._requests.wait_s(key.hash)
        if wait_s:
            raise Problem(
                "rate-limited", "Ask less often, or wait in GET /jobs/{id}?wait=60.", headers=_retry_after(wait_s)
            )
        self._requests.take(key.hash)
        self._uses[key.hash] = datetime.now(UTC)


def page_token(session_token: str) -> str:
    """Return the CSRF token of a session, which its pages send with every change."""
    return hashlib.sha256(f"page of {session_token}".encode()).hexdigest()


def _unexpired(key: Key) -> Key:
    if key.expired:
        raise _invalid_key("key-expired", f"{key.name} was good until {key.expires_at:%Y-%m-%d %H:%M} UTC.")
    return key


def _session_over() -> Problem:
    return Problem("session-over", "Sign in again.", headers={"WWW-Authenticate": "Bearer"})


def _invalid_key(kind: str, detail: str) -> Problem:
    return Problem(kind, detail, headers={"WWW-Authenticate": 'Bearer error="invalid_token"'})


def _retry_after(wait_s: float) -> dict[str, str]:
    return {"Retry-After": str(math.ceil(wait_s))}


def _client_address(request: HTTPConnection) -> str:
    """Return the address of the client; for IPv6 its network of 64 bits, which is what one customer has."""
    host = request.client.host if request.client else ""
    address = ip_of(host)
    if isinstance(address, ipaddress.IPv6Address):
        return str(ipaddress.ip_network((address, 64), strict=False))
    return host
