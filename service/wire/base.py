"""What the models of the interface are made of: ids, names, strict numbers, and the class they all are."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

ID_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
JOB_ID_PATTERN = r"^[0-9A-HJKMNP-TV-Z]{26}$"
# Parts of an upload.
OPTIONS_PART = "options"
PHOTOS_PART = "photos"

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
Name = Annotated[str, StringConstraints(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
# Finite, and a number: neither NaN, which Python's JSON reader lets through, nor true nor "1".
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]

# Of files that poses leave in; `service.formats.table` has what is behind the names.
FormatName = Literal["json", "opencv", "opentrackio", "freed", "colmap", "soccernet", "st-map", "st-map-unreal"]
# What a key allows; each one includes those before it.
Scope = Literal["read", "calibrate", "admin"]


class Wire(BaseModel):
    """A model of the interface: unknown fields are errors, not ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)
