"""The service that a command calls: a client of it, and what is told where it refuses or cannot be reached.

Client and models are imported when a service is called: help and completion, and what is wrong with the arguments of a
command, are told in a third of the time without them.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from service import build
from service.cli.arguments import parse_document
from service.cli.printing import BUSY, FAILED, USAGE, fail, key_hint, print_note, problem_text
from service.schemas.names import ID_PATTERN
from service.variable_names import misspelt_for_client

if TYPE_CHECKING:
    from service.client import Client
    from service.schemas.venue import Venue


@contextmanager
def open_client(url: str, api_key: str | None) -> Iterator[Client]:
    """A client; what goes wrong with the service is a line and an exit code."""
    for name, meant in misspelt_for_client(os.environ).items():
        print_note(f"Warning: {name} is not read: did you mean {meant}?")
    _skip_unused_imports()
    import httpx

    from service.client import Client, NotUnderstood, Refused

    try:
        with Client(url, api_key) as client:
            yield client
    except Refused as refused:
        fail(problem_text(str(refused), refused.members) + key_hint(refused.status), BUSY if refused.busy else FAILED)
    except NotUnderstood as error:
        fail(
            f"{error}\n  This is esc {build.description()}; of the service, {url}/openapi.json tells the version.",
            FAILED,
        )
    except (httpx.InvalidURL, httpx.UnsupportedProtocol) as error:
        fail(f"--url (ESC_URL) is no address such as http://127.0.0.1:8000: {error}", USAGE)
    except httpx.TransportError as error:
        # It may be starting again.
        fail(f"The service at {url} cannot be reached: {error or type(error).__name__}", BUSY)


def _skip_unused_imports() -> None:
    """Leave out what nothing here uses, and what takes a quarter of the time of a short command.

    httpx has a command line of its own, which it does without where that cannot be imported. pydantic looks for
    plugins among all that is installed.
    """
    sys.modules.setdefault("httpx._main", None)  # type: ignore[arg-type]
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def load_venue(venue: str, url: str, api_key: str | None) -> Venue:
    """A venue of the service by its id, or of a file."""
    if Path(venue).is_file():
        from service.schemas.venue import VenueIn

        return parse_document(VenueIn, Path(venue).read_bytes(), venue).to_venue()
    if not re.fullmatch(ID_PATTERN, venue):
        fail(f"There is no file {venue}, and it is no id such as `esc venue list` prints", USAGE)
    with open_client(url, api_key) as client:
        return client.venue(venue)
