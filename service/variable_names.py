"""The names of environment variables `ESC_...` that are no settings, and what a misspelt one was meant to be."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches

PREFIX = "ESC_"
# What commands of the client read.
OF_CLIENTS = frozenset({"ESC_URL", "ESC_API_KEY", "ESC_API_KEY_FILE"})
# What others read: docker/compose.yaml and docker/systemd/esc-live@.service, and a child process of its parent.
OF_OTHERS = frozenset({"ESC_DATABASE_PASSWORD", "ESC_LIVE", "ESC_PARENT"})
OF_TESTS = "ESC_TEST_"
# So alike are a name and a slip of the pen in it. No setting is so like a variable of the client.
SLIP = 0.8


def unread(given: Iterable[str], settings: Collection[str]) -> list[str]:
    """Return those of the given `ESC_...` names, in capitals, that neither a setting nor anybody else has."""
    names = {name.upper() for name in given if name.upper().startswith(PREFIX)}
    # Kubernetes tells a pod of each service: ESC_API_SERVICE_HOST, ESC_API_PORT_8000_TCP ... of one named esc-api.
    services = tuple(name.removesuffix("SERVICE_HOST") for name in names if name.endswith("_SERVICE_HOST"))
    of_kubernetes = tuple(f"{service}{part}" for service in services for part in ("SERVICE_", "PORT"))
    known = {*settings, *OF_CLIENTS, *OF_OTHERS}
    return sorted(name for name in names - known if not name.startswith((OF_TESTS, *of_kubernetes)))


def suggestion(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that a misspelt one is most like; None if it is like none of them."""
    # What all names begin with makes none of them alike.
    parts = sorted(one.removeprefix(PREFIX) for one in known)
    near = get_close_matches(name.removeprefix(PREFIX), parts, 1)
    return f"{PREFIX}{near[0]}" if near else None


def misspelt_for_client(given: Iterable[str]) -> dict[str, str]:
    """Return the variable of the client that each of the given names is a slip of; no setting is a slip."""
    near = {name: get_close_matches(name, OF_CLIENTS, 1, SLIP) for name in unread(given, ())}
    return {name: meant[0] for name, meant in near.items() if meant}
