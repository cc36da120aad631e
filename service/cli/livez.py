"""`python -m service.cli.livez`: the health check of a container, which asks the API where the settings have it listen.

Not a command of `esc`: only a container asks itself. `--host` and `--port` of the API's own command line are not known
here, ESC_HOST and ESC_PORT are.
"""

import ipaddress
import sys
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException

from service.cli.printing import FAILED, fail
from service.cli.service_settings import load_settings

ANSWER_S = 4.0


def main() -> None:
    """Exit with 0 if the API answers."""
    settings = load_settings()
    # Without the proxies of the environment, which urllib would ask.
    connection = HTTPConnection(_host_to_ask(settings.host), settings.port, timeout=ANSWER_S)
    try:
        connection.request("GET", "/livez")
        status = connection.getresponse().status
    except (OSError, HTTPException) as error:
        fail(f"Nothing answers at {connection.host}, port {connection.port}: {error}", FAILED)
    if status != HTTPStatus.OK:
        fail(f"/livez at {connection.host}, port {connection.port} answers {status}, expected 200", FAILED)
    sys.exit(0)


def _host_to_ask(host: str) -> str:
    """Return where to reach what listens on a host: on all addresses of the machine, its own."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if not address.is_unspecified:
        return host
    return "127.0.0.1" if address.version == 4 else "::1"


if __name__ == "__main__":
    main()
