"""Rows that cannot be read: one of them must take down neither a list nor a duty that meets it.

Everything that makes a model of a row does so inside `reading_row`, which names the row where that fails. Whoever
reads one row lets `UnreadableRow` pass, and the interface answers with a problem; whoever reads several takes
`read_each`, and goes on with the others; what is only derived (statistics, memories) begins anew by `read_or`.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Literal, TypeVar

import structlog
from pydantic import BaseModel, ValidationError

from service.schemas.base import TOLERANTLY, Unreadable
from service.schemas.findings import describe_errors

RowKind = Literal["venue", "job", "revision", "event", "live", "statistics", "memory", "trend"]
# For so long a row counts as unreadable after somebody has met it: who deletes it need not tell other processes.
REMEMBERED_S = 3600.0
# Rows are named to people who can look at so many.
MOST_REMEMBERED = 1000
# The faults of a row that are shown to a person.
MOST_FAULTS = 3
# Errors that broken documents raise where code expects another shape: an array instead of an object, a missing member.
MISSHAPEN = (ValidationError, ValueError, KeyError, TypeError, AttributeError)
Row = TypeVar("Row")
Read = TypeVar("Read")
Model = TypeVar("Model", bound=BaseModel)
log = structlog.get_logger()
_met: dict[tuple[RowKind, str], float] = {}


class UnreadableRow(Exception):  # noqa: N818
    """A stored row that this program cannot read, with its kind and id; `why`: what is wrong with it, in words."""

    def __init__(self, kind: RowKind, row_id: str, why: str) -> None:
        super().__init__(f"{kind} {row_id} cannot be read: {why}")
        self.kind: RowKind = kind
        self.id = row_id
        self.why = why

    @property
    def entry(self) -> Unreadable:
        """The row as lists show it."""
        return Unreadable(id=self.id, why=self.why)


@contextmanager
def reading_row(kind: RowKind, row_id: str) -> Iterator[None]:
    """Raise `UnreadableRow` where the block cannot make a model of a row."""
    try:
        yield
    except MISSHAPEN as error:
        why = _in_words(error)
        _remember(kind, row_id, why)
        raise UnreadableRow(kind, row_id, why) from error
    _met.pop((kind, row_id), None)


def read_each(rows: Iterable[Row], read: Callable[[Row], Read]) -> tuple[list[Read], list[Unreadable]]:
    """Read several rows; those that cannot be read are returned apart."""
    readable: list[Read] = []
    unreadable: list[Unreadable] = []
    for row in rows:
        try:
            readable.append(read(row))
        except UnreadableRow as error:
            unreadable.append(error.entry)
    return readable, unreadable


def read_or(default: Read, kind: RowKind, row_id: str, read: Callable[[], Read]) -> Read:
    """Read what can begin anew where it cannot be read: what is folded from events, and what only helps."""
    try:
        with reading_row(kind, row_id):
            return read()
    except UnreadableRow:
        return default


def read_values(model: type[Model], documents: Any, kind: RowKind, row_id: str) -> dict[str, Model]:
    """Read an object of documents, such as one of each camera, but for those that cannot be read."""
    values = documents if isinstance(documents, Mapping) else {}
    read = {
        name: read_or(None, kind, f"{row_id}/{name}", partial(model.model_validate, one, **TOLERANTLY))
        for name, one in values.items()
    }
    return {name: one for name, one in read.items() if one is not None}


def unreadable_rows() -> Counter[RowKind]:
    """Count the rows that this process could not read within the last hour, by kind."""
    since = time.monotonic() - REMEMBERED_S
    return Counter(kind for (kind, _), at in list(_met.items()) if at >= since)


def _in_words(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return "; ".join(describe_errors(error.errors()[:MOST_FAULTS], None, None))
    return f"it has another shape ({type(error).__name__}: {error})"[:200]


def _remember(kind: RowKind, row_id: str, why: str) -> None:
    now, known = time.monotonic(), _met.get((kind, row_id))
    if known is None or known < now - REMEMBERED_S:
        log.error("a stored row cannot be read", kind=kind, id=row_id, why=why)
    elif len(_met) >= MOST_REMEMBERED:
        return
    _met[kind, row_id] = now
