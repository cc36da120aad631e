"""What the models of the interface are made of: names, strict numbers, and the class they all are.

The models are strict for what clients send. What another version of ESC may have written, an answer of a service or a
stored document, is read with `TOLERANTLY`, by the same models.
"""

from __future__ import annotations

import re
from datetime import date
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from service.schemas.names import ID_PATTERN

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
NAME_PATTERN = r"^[^\x00-\x1f\x7f]*$"
Name = Annotated[str, StringConstraints(max_length=200, pattern=NAME_PATTERN)]
# Finite, and a number: neither NaN, which Python's JSON reader lets through, nor true nor "1".
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Integer = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]


def _as_written(day: Any) -> Any:
    if isinstance(day, str) and not re.fullmatch(r"\d{4}-\d{2}-\d{2}", day, re.ASCII):
        raise ValueError("expected a day such as 2026-11-03")
    return day


# Not a number of seconds as well, which Pydantic would take for a day.
Day = Annotated[date, BeforeValidator(_as_written)]


class _WrittenByAnotherVersion:
    """The validation context that says who wrote a document."""


# Of `model_validate` and `model_validate_json`: fields that this version does not know are ignored, here and in every
# model inside, and words that it does not know are kept, see `OPEN_WORD`.
TOLERANTLY: dict[str, Any] = {"extra": "ignore", "context": _WrittenByAnotherVersion()}


def is_tolerant(info: ValidationInfo) -> bool:
    """True while a document is read `TOLERANTLY`."""
    return info.context is TOLERANTLY["context"]


def _or_a_newer_word(word: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    try:
        return check(word)
    except ValidationError:
        if is_tolerant(info) and isinstance(word, str):
            return word
        raise


# Of a field that is one of several words: a newer version may know more of them.
OPEN_WORD = WrapValidator(_or_a_newer_word)


class Schema(BaseModel):
    """A model of the interface: unknown fields are errors, unless a document is read `TOLERANTLY`."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Unreadable(Schema):
    """An entry of a list that the service has stored and cannot read, and why."""

    id: str
    why: str = Field(examples=["field: the ridge must be 0 to 3 m high, not -0.001 m"])


UNREADABLE = "Entries of this page that are stored and cannot be read; absent where there are none."


def is_empty(value: object) -> bool:
    """Return True for a list that is left out of an answer unless it has entries."""
    return value == []


def is_none(value: object) -> bool:
    """Whether a field is left out that is only there when it says something."""
    return value is None
