"""What the models of the interface are made of: names, strict numbers, and the class they all are."""

from __future__ import annotations

import re
from datetime import date
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints

from service.wire.names import ID_PATTERN

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
Name = Annotated[str, StringConstraints(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
# Finite, and a number: neither NaN, which Python's JSON reader lets through, nor true nor "1".
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]


def _as_written(day: Any) -> Any:
    if isinstance(day, str) and not re.fullmatch(r"\d{4}-\d{2}-\d{2}", day, re.ASCII):
        raise ValueError("expected a day such as 2026-11-03")
    return day


# Not a number of seconds as well, which Pydantic would take for a day.
Day = Annotated[date, BeforeValidator(_as_written)]


class Wire(BaseModel):
    """A model of the interface: unknown fields are errors, not ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)
