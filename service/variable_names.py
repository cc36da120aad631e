"""Detection of misspelt environment variables `ESC_...`."""

from collections.abc import Collection, Iterable
from difflib import get_close_matches

PREFIX = "ESC_"
# Read by commands of the client.
OF_CLIENTS = frozenset(
    {
        "ESC_URL",
        "ESC_API_KEY",
        "ESC_API_KEY_FILE",
        "ESC_MQTT_BROKER",
        "ESC_MQTT_PASSWORD",
        "ESC_MQTT_PASSWORD_FILE",
        "ESC_MCP_ALLOW_STORING",
    }
)
# Read by docker/compose.yaml and docker/systemd/esc-live@.service, and by child processes.
OF_OTHERS = frozenset({"ESC_DATABASE_PASSWORD", "ESC_LIVE", "ESC_PARENT"})
OF_TESTS = "ESC_TEST_"
# Least similarity of a name and a misspelling of it. No setting is that similar to a variable of the client.
SLIP = 0.8


def unread(variables: Iterable[str], settings: Collection[str]) -> list[str]:
    """Return the `ESC_...` names among the variables, in capitals, that nothing reads."""
    names = {name.upper() for name in variables if name.upper().startswith(PREFIX)}
    # Kubernetes sets variables for each service, for esc-api: ESC_API_SERVICE_HOST, ESC_API_PORT_8000_TCP ...
    services = tuple(name.removesuffix("SERVICE_HOST") for name in names if name.endswith("_SERVICE_HOST"))
    of_kubernetes = tuple(f"{service}{part}" for service in services for part in ("SERVICE_", "PORT"))
    known = {*settings, *OF_CLIENTS, *OF_OTHERS}
    return sorted(name for name in names - known if not name.startswith((OF_TESTS, *of_kubernetes)))


def suggestion(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most similar to a misspelt one; None if none is."""
    # Compared without the common prefix, which would make all names similar.
    parts = sorted(one.removeprefix(PREFIX) for one in known)
    near = get_close_matches(name.removeprefix(PREFIX), parts, 1)
    return f"{PREFIX}{near[0]}" if near else None


def misspelt_for_client(variables: Iterable[str]) -> dict[str, str]:
    """Return misspelt variables of the client, each with its correct name."""
    near = {name: get_close_matches(name, OF_CLIENTS, 1, SLIP) for name in unread(variables, ())}
    return {name: meant[0] for name, meant in near.items() if meant}
