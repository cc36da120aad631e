"""The client that commands call a service with; exit with a line where it refuses or cannot be reached."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from service import build
from service.cli.arguments import parse_document
from service.cli.printing import BUSY, FAILED, USAGE, fail, key_hint, print_note, problem_text
from service.client import Client, NotUnderstood, Refused
from service.schemas.names import ID_PATTERN
from service.schemas.venue import Venue, VenueIn
from service.variable_names import misspelt_for_client


@contextmanager
def open_client(url: str, api_key: str | None) -> Iterator[Client]:
    """Yield a client of a service; exit with a line and a code where a call fails."""
    for name, meant in misspelt_for_client(os.environ).items():
        print_note(f"Warning: {name} is not read: did you mean {meant}?")
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
        # The service may be restarting.
        fail(f"The service at {url} cannot be reached: {error or type(error).__name__}", BUSY)


def load_venue(venue: str, url: str, api_key: str | None) -> Venue:
    """Return a venue from its JSON file, or from the service by its id."""
    if Path(venue).is_file():
        return parse_document(VenueIn, Path(venue).read_bytes(), venue).to_venue()
    if not re.fullmatch(ID_PATTERN, venue):
        fail(f"There is no file {venue}, and it is no id such as `esc venue list` prints", USAGE)
    with open_client(url, api_key) as client:
        return client.venue(venue)
