"""Both homes, and services in them that end with their block."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from testbed.homes import HASTY, Embedded, Home, Servers, environment, postgres_binaries, postgres_server, s3_server
from testbed.running import Service

# What PostgreSQL has committed outlives its processes; nothing here has to outlive the machine.
SURE = ("fsync=off", "full_page_writes=off")
EMBEDDED, SERVERS = "SQLite, folder", "PostgreSQL, S3"


@contextmanager
def homes(postgres_options: Sequence[str] = HASTY) -> Iterator[dict[str, Home]]:
    """Yield both homes by their names; PostgreSQL runs with these options."""
    binaries = postgres_binaries()
    if binaries is None:
        raise SystemExit("PostgreSQL is needed (Debian: apt-get install postgresql)")
    with postgres_server(binaries, postgres_options) as postgres, s3_server() as bucket:
        yield {EMBEDDED: Embedded(), SERVERS: Servers(postgres, bucket)}


@contextmanager
def service(home: Home, *arguments: str, **settings: str) -> Iterator[Service]:
    """`esc up` or what the arguments say, on a folder of its own, with the settings' defaults for silence."""
    with tempfile.TemporaryDirectory(prefix="esc-bench-") as name:
        folder = Path(name) / "esc"
        given = environment(home.settings(folder)) | {"ESC_TAKEOVER_AFTER_S": "10", "ESC_TIDY_EVERY_S": "1"} | settings
        running = Service(folder, *arguments, **given)
        try:
            yield running
        finally:
            running.kill()
