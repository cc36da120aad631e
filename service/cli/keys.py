"""`esc key`: who may call a service of this machine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.arguments import Data, settings_of
from service.cli.printing import FAILED, USAGE, fail, tell
from service.cli.serve import database_told
from service.wire.names import ID_PATTERN, Scope

if TYPE_CHECKING:
    from service.store.keys import Keys

ELSEWHERE = "Of a service that has its folder elsewhere, name it: --data, or ESC_DATA."
app = typer.Typer(no_args_is_help=True, help="API keys, in the database of this machine's service.")


@app.command("add")
def add_key(
    name: Annotated[str, typer.Argument(help="Name for the key: of the machine or person that will use it.")],
    scope: Annotated[
        Scope,
        typer.Option(
            "--scope", help="What it may do: read; calibrate, which includes that; admin, which includes both."
        ),
    ],
    days: Annotated[
        int | None, typer.Option("--days", min=1, max=36500, help="Days after which it expires; otherwise never.")
    ] = None,
    data: Data = None,
) -> None:
    """Make a key and print it, this once: what is stored is its hash."""
    from service.store.keys import KeyExists

    if not re.fullmatch(ID_PATTERN, name):
        fail(f"{name!r} is no name of a key: up to 64 of a-z, 0-9, - and _, the first a letter or a digit.", USAGE)
    with _keys(data) as keys:
        try:
            key = keys.add(name, scope, datetime.now(UTC) + timedelta(days) if days else None)
        except KeyExists:
            fail(f"There is a key {name} already: remove it first, or take another name.", USAGE)
    print(key)
    tell("Keep it: it is not shown again. Its user sets ESC_API_KEY, or sends it as `Authorization: Bearer ...`.")


@app.command("list")
def list_keys(data: Data = None) -> None:
    """Print a line per key: name, scope, when it was made, when (to the minute) last used, until when it is good."""
    with _known_keys(data) as keys:
        for key in keys.all():
            used, until = (f"{at:%Y-%m-%dT%H:%MZ}" if at else "-" for at in (key.last_used_at, key.expires_at))
            state = " (expired)" if key.expired else ""
            print(f"{key.name}\t{key.scope}\t{key.created_at:%Y-%m-%dT%H:%MZ}\t{used}\t{until}{state}")


@app.command("remove")
def remove_key(
    name: Annotated[str, typer.Argument(help="Name of the key, as `esc key list` prints it.")], data: Data = None
) -> None:
    """Forget a key."""
    from service.api.auth import BELIEVED_FOR_S

    with _known_keys(data) as keys:
        if not keys.remove(name):
            fail(f"There is no key {name}; esc key list names those there are.", FAILED)
        left = keys.any()
    tell(f"Removed. A service that runs may take it for {BELIEVED_FOR_S:.0f} s more.")
    if not left:
        tell("No key is left: a service on loopback will let anyone on this machine call after its next start.")


@contextmanager
def _known_keys(data: Path | None) -> Iterator[Keys]:
    """The keys of a service that has been there: to ask for them makes none."""
    url = settings_of(data=data).home_database_url
    if url.startswith("sqlite") and not Path(url.partition("sqlite:///")[2]).exists():
        fail(f"There is no service here: {url} does not exist. {ELSEWHERE}", FAILED)
    with _keys(data) as keys:
        yield keys


@contextmanager
def _keys(data: Path | None) -> Iterator[Keys]:
    """The keys of the service whose folder or database the settings name."""
    from service.store.engine import connect, migrate
    from service.store.keys import Keys

    settings = settings_of(data=data)
    with database_told():
        engine = connect(settings.home_database_url)
        # Keys of another folder open nothing, and nothing else would tell.
        tell(f"Keys in {engine.url.set(query={}).render_as_string(hide_password=True)}")
        made = engine.dialect.name == "sqlite" and not Path(engine.url.database or "").exists()
        migrate(engine)
        if made:
            tell(f"That database is new: no service has used it yet. {ELSEWHERE}")
        yield Keys(engine)
        engine.dispose()
