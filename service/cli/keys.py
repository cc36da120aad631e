"""`esc key`: API keys of a service on this machine."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import Data, Yes, require_yes
from service.cli.local_database import report_database_errors, require_folders
from service.cli.printing import FAILED, USAGE, fail, print_note, print_rows
from service.cli.service_settings import load_settings
from service.schemas.names import ID_IN_WORDS, ID_PATTERN, Scope
from service.schemas.problems import Problem
from service.store.database import connect, migrate, sqlite_file
from service.store.keys import KEY_CACHED_FOR_S, KeyRepository, old_name

OTHER_FOLDER_HINT = "Of a service that has its folder elsewhere, name it: --data, or ESC_DATA."
UNITS = {"m": timedelta(minutes=1), "h": timedelta(hours=1), "d": timedelta(days=1)}
app = typer.Typer(no_args_is_help=True, help="API keys, in the database of this machine's service.")


@app.command("add")
def add_key(
    name: Annotated[str, typer.Argument(help="Name of the key, for example the machine or person that will use it.")],
    scope: Annotated[
        Scope, typer.Option(help="Scope: read; calibrate, which includes read; admin, which includes both.")
    ],
    days: Annotated[
        int | None, typer.Option(min=1, max=36500, help="Days until the key expires; default: never.")
    ] = None,
    venues: Annotated[
        list[str] | None,
        typer.Option("--venue", metavar="ID", help="Venue that the key works for, repeatable; default: all venues."),
    ] = None,
    data: Data = None,
) -> None:
    """Make a key and print it. It is shown only once: ESC stores its hash."""
    if not re.fullmatch(ID_PATTERN, name):
        fail(f"{name!r} is no name of a key: {ID_IN_WORDS}.", USAGE)
    for venue in venues or ():
        if not re.fullmatch(ID_PATTERN, venue):
            fail(f"{venue!r} is no id of a venue: {ID_IN_WORDS}.", USAGE)
    with _keys(data) as keys:
        try:
            key = keys.add(name, scope, datetime.now(UTC) + timedelta(days) if days else None, venues or None)
        except Problem as problem:
            if problem.kind != "key-exists":
                raise
            fail(f"There is a key {name} already: remove it first, or take another name.", USAGE)
        is_first = len(keys.all()) == 1
    _print_key(key)
    if is_first:
        print_note("This is the first key: from now on every caller needs one.")


@app.command("list")
def list_keys(data: Data = None) -> None:
    """Print a line per key: name, scope, when it was made, last used (to the minute), good until, and its venues."""
    rows = []
    with _known_keys(data) as keys:
        for key in keys.all():
            used, until = (f"{at:%Y-%m-%dT%H:%MZ}" if at else "-" for at in (key.last_used_at, key.expires_at))
            venues = "all" if key.venues is None else ",".join(sorted(key.venues))
            state = " (expired)" if key.expired else ""
            rows.append([key.name, key.scope, f"{key.created_at:%Y-%m-%dT%H:%MZ}", used, f"{until}{state}", venues])
    print_rows(["KEY", "SCOPE", "MADE", "LAST USED", "GOOD UNTIL", "VENUES"], rows)


@app.command("rotate")
def rotate_key(
    name: Annotated[str, typer.Argument(help="Name of the key, as `esc key list` prints it.")],
    grace: Annotated[
        str, typer.Option(metavar="TIME", help="How long the old key still works, such as 30m, 24h or 7d.")
    ] = "24h",
    data: Data = None,
) -> None:
    """Replace a key by a new one and print that, only once; the old one works for a while longer, as NAME-old."""
    length = re.fullmatch(r"(\d{1,5})([mhd])", grace, re.ASCII)
    if length is None:
        fail(f"{grace!r} is no time: a number and m, h or d, such as 30m, 24h or 7d.", USAGE)
    grace_time = int(length[1]) * UNITS[length[2]]
    with _known_keys(data) as keys:
        key = keys.rotate(name, grace_time)
    if key is None:
        fail(f"There is no key {name}; esc key list names those there are.", FAILED)
    _print_key(key)
    print_note(
        f"The old key is {old_name(name)} now and good until {datetime.now(UTC) + grace_time:%Y-%m-%dT%H:%MZ} at most."
    )


@app.command("remove")
def remove_key(
    name: Annotated[str, typer.Argument(help="Name of the key, as `esc key list` prints it.")],
    yes: Yes = False,
    data: Data = None,
) -> None:
    """Forget a key."""
    require_yes(yes, f"Forget key {name}, which its user then calls with in vain")
    with _known_keys(data) as keys:
        if not keys.remove(name):
            fail(f"There is no key {name}; esc key list names those there are.", FAILED)
        left = keys.any()
    print_note(f"Removed. A service that runs may take it for {KEY_CACHED_FOR_S:.0f} s more.")
    if not left:
        print_note("No key is left: a service on loopback will let anyone on this machine call after its next start.")


def _print_key(key: str) -> None:
    print(key)
    print_note("Keep it: it is not shown again. Its user sets ESC_API_KEY, or sends it as `Authorization: Bearer ...`.")


@contextmanager
def _known_keys(data: Path | None) -> Iterator[KeyRepository]:
    """Yield the keys of a service that has run before; exit where it has no database yet."""
    url = load_settings(data=data).home_database_url
    file = sqlite_file(url)
    if file is not None and not file.exists():
        fail(f"There is no service here: {url} does not exist. {OTHER_FOLDER_HINT}", FAILED)
    with _keys(data) as keys:
        yield keys


@contextmanager
def _keys(data: Path | None) -> Iterator[KeyRepository]:
    """Yield the keys of the service whose folder or database the settings name."""
    settings = load_settings(data=data)
    require_folders(settings)
    with report_database_errors(settings):
        engine = connect(settings.home_database_url)
        # Keys of another folder open nothing, and nothing else would tell.
        print_note(f"Keys in {engine.url.set(query={}).render_as_string(hide_password=True)}")
        if elsewhere := os.environ.get("ESC_URL"):
            # The other commands go there: a key that is made here opens nothing of it.
            print_note(f"This is the database of this machine; the service at ESC_URL ({elsewhere}) is not asked.")
        made = engine.dialect.name == "sqlite" and not Path(engine.url.database or "").exists()
        migrate(engine)
        if made:
            print_note(f"That database is new: no service has used it yet. {OTHER_FOLDER_HINT}")
        yield KeyRepository(engine)
        engine.dispose()
