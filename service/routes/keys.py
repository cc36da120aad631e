"""API keys: listed, made and revoked by who has one of scope `admin` for all venues."""

from typing import Annotated

import structlog
from fastapi import APIRouter, Depends, Path

from service.api.context import InContext
from service.routes.contract.attribution import caller_key
from service.routes.contract.documented import needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import problem_responses
from service.schemas.keys import ApiKey, ApiKeys, KeyIn, MadeKey
from service.schemas.names import ID_PATTERN
from service.schemas.problems import Problem
from service.store.keys import Key

log = structlog.get_logger()
router = APIRouter(prefix="/keys", tags=["keys"], route_class=Guarded)


def _administrator() -> Key:
    """Return the key of the caller: where none is asked for, nobody may make the first one from afar."""
    key = caller_key.get()
    if key is None:
        raise Problem("key-missing", "The first key is made on the machine of the service, by `esc key add`.")
    return key


Administrator = Annotated[Key, Depends(_administrator)]


@router.get("", openapi_extra=needs_scope("admin"))
def list_keys(by: Administrator, context: InContext) -> ApiKeys:  # noqa: ARG001
    """List all keys, by name: what they may do and when they were last used."""
    return ApiKeys(keys=[_shown(key) for key in context.keys.all()])


@router.post("", openapi_extra=needs_scope("admin"), status_code=201, responses=problem_responses("key-exists"))
def add_key(wanted: KeyIn, by: Administrator, context: InContext) -> MadeKey:
    """Make a key and return it, this once: what is stored is its hash."""
    key = context.keys.add(wanted.name, wanted.scope, wanted.expires_at, wanted.venue_ids)
    log.info("key made", name=wanted.name, scope=wanted.scope, venues=wanted.venue_ids, by=by.name)
    return MadeKey(name=wanted.name, key=key)


@router.delete(
    "/{key_name}",
    openapi_extra=needs_scope("admin"),
    status_code=204,
    responses=problem_responses("key-not-found", "key-in-use"),
)
def revoke_key(
    key_name: Annotated[str, Path(pattern=ID_PATTERN, description="Name of the key.")],
    by: Administrator,
    context: InContext,
) -> None:
    """Revoke a key, but not the one that asks. It may be taken for 5 s more, and streams go on to their end."""
    if key_name == by.name:
        raise Problem("key-in-use", "Revoke it with another key, or by `esc key remove` on the machine of the service.")
    if not context.keys.remove(key_name):
        raise Problem("key-not-found", "GET /keys lists those there are.")
    log.info("key revoked", name=key_name, by=by.name)


def _shown(key: Key) -> ApiKey:
    return ApiKey(
        name=key.name,
        scope=key.scope,
        created_at=key.created_at,
        expires_at=key.expires_at,
        last_used_at=key.last_used_at,
        venue_ids=None if key.venues is None else sorted(key.venues),
    )
