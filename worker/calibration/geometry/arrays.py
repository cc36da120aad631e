"""The kinds of arrays that the engine hands around."""

from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Array = NDArray[np.float64]
Plane = NDArray[np.floating[Any]]
"""One coordinate of many points, in the precision of the caller."""

Record = TypeVar("Record", bound="DataclassInstance")


def take_rows(record: Record, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Record:
    """Return a record with some rows of its arrays, and of the records in it that have rows; all else as it is."""
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    rows = {name: value[chosen] for name, value in values.items() if _has_rows(value)}
    return replace(record, **rows)


def _has_rows(value: object) -> bool:
    return isinstance(value, np.ndarray) or (is_dataclass(value) and hasattr(value, "__getitem__"))
