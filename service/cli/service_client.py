"""The client that commands call a service with; exit with a line where it refuses or cannot be reached."""

import inspect
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import httpx
import typer

from service import build
from service.cli.arguments import DEFAULT_URL, ApiKey, Url, parse_document
from service.cli.printing import BUSY, FAILED, USAGE, fail, key_hint, print_note, problem_text
from service.client import Client, NotUnderstood, Refused
from service.schemas.names import ID_PATTERN
from service.schemas.venue import Venue, VenueIn
from service.variable_names import misspelt_for_client

Command = TypeVar("Command", bound=Callable[..., None])


class ServiceCommands(typer.Typer):
    """A group of commands, each of which calls a service, see `with_client`."""

    def command(self, name: str, **attributes: Any) -> Callable[[Command], Command]:  # type: ignore[override]
        """Add a command, whose first parameter is the client."""

        def add(command: Command) -> Command:
            super(ServiceCommands, self).command(name, **attributes)(with_client(command))
            return command

        return add


def with_client(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command with --url and --api-key, which runs with a client of that service as its first argument."""

    @wraps(command)
    def run(url: str, api_key: str | None, **arguments: Any) -> None:
        with open_client(url, api_key) as client:
            command(client, **arguments)

    signature = inspect.signature(command)
    _, *own = signature.parameters.values()
    of_service = [
        inspect.Parameter("url", inspect.Parameter.KEYWORD_ONLY, default=DEFAULT_URL, annotation=Url),
        inspect.Parameter("api_key", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=ApiKey),
    ]
    # Typer reads the options of a command from its signature.
    run.__signature__ = signature.replace(parameters=[*own, *of_service])  # type: ignore[attr-defined]
    return run


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
