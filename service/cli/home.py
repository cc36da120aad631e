"""`esc home`: copies of the database and the files of a service."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import sqlalchemy as sa
import typer

from service import queue
from service.cli.local_database import report_database_errors
from service.cli.printing import FAILED, USAGE, fail, print_note, print_rows
from service.cli.service_settings import load_settings
from service.settings import BLOB_URL, DATABASE_URL, Settings
from service.store.blobs import BLOB_OUTAGES, Blobs
from service.store.copying import CannotCopy, copy_rows, exclusive_snapshot, require_empty
from service.store.database import connect, reading, sqlite_file

# A bucket that does not answer is asked again for so long.
BLOB_PATIENCE_S = 120.0
ENDING = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
LOCATION_HELP = (
    "A data folder (with its esc.sqlite), or the URL of a database: postgresql://user:password@host:5432/name."
)
app = typer.Typer(no_args_is_help=True, help="The home of a service: its database and its files.")


@app.callback()
def home() -> None:
    """The home of a service: its database and its files."""


@dataclass(frozen=True)
class ServiceLocation:
    """Database and blob store of a service, as URLs; `blobs` None: not given."""

    database: str
    blobs: str | None


@app.command("copy")
def copy_home(
    source: Annotated[str, typer.Argument(metavar="FROM", help=f"What is copied. {LOCATION_HELP}")],
    target: Annotated[str, typer.Argument(metavar="TO", help="Where to, the same; empty, or not there yet.")],
    blobs_from: Annotated[
        str | None,
        typer.Option(
            help="Store of frames and pictures of FROM, s3: or file: URL [default: in its folder; of a database "
            "ESC_BLOB_URL, or the folder ESC_DATA]"
        ),
    ] = None,
    blobs_to: Annotated[
        str | None, typer.Option(help="That of TO [default: in its folder; of a database that of FROM: they stay]")
    ] = None,
) -> None:
    """Copy a stopped service to another database, SQLite or PostgreSQL: all that it keeps, or nothing.

    Venues, history, memories, trends, charts, schedules, jobs and keys. Open jobs wait in the queue of the copy. FROM
    stays as it is.
    """
    here, there = _parse_location(source, blobs_from), _parse_location(target, blobs_to)
    if here.database == there.database:
        fail("FROM and TO are one database.", USAGE)
    blobs_here = here.blobs or load_settings().home_blob_url
    blobs_there = there.blobs or blobs_here
    with report_database_errors():
        try:
            with _ended_by_signals() as ignore_signals:
                files, rows = _copy(here.database, there.database, blobs_here, blobs_there, ignore_signals)
        except CannotCopy as refusal:
            fail(f"Nothing was copied. {refusal}", USAGE)
        except BLOB_OUTAGES as error:
            fail(f"Nothing was copied. The files cannot be copied: {error}", FAILED)
    counts = [(table, str(count)) for table, count in rows.items()]
    print_rows(["TABLE", "ROWS"], [*counts, ("files", "they stay" if files is None else str(files))])
    print_note("Start the service with what its settings now must say:")
    database = sa.make_url(there.database).render_as_string(hide_password=True)
    print_note(f"  ESC_DATABASE_URL={database}\n  ESC_BLOB_URL={blobs_there}")


@contextmanager
def _ended_by_signals() -> Iterator[Callable[[], None]]:
    """Have SIGTERM, and SIGHUP of a terminal that is closed, end the block as Ctrl-C does, so that it tidies up.

    Gives what has all three ignored: whoever asks twice breaks off no tidying.
    """
    before = {number: signal.getsignal(number) for number in ENDING}

    def ignore() -> None:
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)

    def end(number: int, _: object) -> None:
        ignore()
        print_note(f"Nothing is copied: ended by {signal.Signals(number).name}.")
        sys.exit(128 + number)

    for number, handler in before.items():
        # Under `nohup` SIGHUP is ignored.
        if handler is not signal.SIG_IGN:
            signal.signal(number, end)
    try:
        yield ignore
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _copy(
    source: str, target: str, blobs_from: str, blobs_to: str, committing: Callable[[], None]
) -> tuple[int | None, dict[str, int]]:
    """Copy files and rows; gives how many files, None if they stay, and how many rows each table has.

    `committing` is called when from now on nothing may be taken back.
    """
    with ExitStack() as stack:
        snapshot = stack.enter_context(exclusive_snapshot(source))
        engine = stack.enter_context(_new_database(target))
        files = None
        if blobs_from != blobs_to:
            here, there = Blobs(blobs_from, BLOB_PATIENCE_S), Blobs(blobs_to, BLOB_PATIENCE_S)
            files = stack.enter_context(_copy_files(here, there, blobs_to))
        queue.migrate(target)
        waiting = queue.Queue(target)
        stack.callback(waiting.close)
        return files, copy_rows(snapshot, engine, waiting.enqueue, committing)


@contextmanager
def _new_database(url: str) -> Iterator[sa.Engine]:
    """Yield an engine on an empty database; if the block fails, what was made there is removed again."""
    file = sqlite_file(url)
    was_there = file is not None and file.exists()
    engine = connect(url)
    try:
        with reading(engine) as connection:
            require_empty(connection)
            has_queue = queue.SCHEMA in sa.inspect(connection).get_schema_names()
        try:
            yield engine
        except BaseException:
            engine.dispose()
            if file is None and not has_queue:
                queue.remove(url)
            raise
    except BaseException:
        engine.dispose()
        if file is not None and not was_there:
            for part in ("", "-wal", "-shm"):
                file.with_name(file.name + part).unlink(missing_ok=True)
        raise
    engine.dispose()


@contextmanager
def _copy_files(here: Blobs, there: Blobs, url: str) -> Iterator[int]:
    """Copy every file and yield their count; if the block fails, the copies are deleted again."""
    paths, before = [*here.paths()], {*there.paths()}
    # A copy that was killed left some of them, which are copied again.
    if foreign := sorted(before.difference(paths)):
        raise CannotCopy(
            f"{url} has files that FROM has not ({len(foreign)}, such as {foreign[0]}): name an empty folder or part "
            "of a bucket with --blobs-to."
        )
    copied: list[str] = []
    try:
        for path in paths:
            data = here.get(path)
            if data is None:
                raise CannotCopy(f"{path} vanished while it was copied: something still deletes files of the source.")
            copied.append(path)
            there.put(path, data)
        yield len(copied)
    except BaseException:
        there.delete([path for path in copied if path not in before])
        raise


def _parse_location(text: str, blobs: str | None) -> ServiceLocation:
    if blobs is not None and not BLOB_URL.fullmatch(blobs):
        fail("Expected is s3://bucket, s3://bucket/folder or file:///folder for files.", USAGE)
    if DATABASE_URL.fullmatch(text):
        return ServiceLocation(text, blobs)
    if "://" in text:
        fail("Expected is a folder, postgresql://user:password@host:5432/name or sqlite:////folder/esc.sqlite.", USAGE)
    folder = Settings.model_construct(data=Path(text), database_url=None, blob_url=blobs)
    return ServiceLocation(folder.home_database_url, folder.home_blob_url)
