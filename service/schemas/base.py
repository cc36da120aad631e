"""Base class and basic types of the models of the interface.

The models are strict about requests. Documents that another version of ESC may have written (answers of a service,
stored rows) are read by the same models with `TOLERANTLY`.
"""

import re
from dataclasses import dataclass
from datetime import date, datetime
from typing import Annotated, Any

from pydantic import (
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic.json_schema import JsonSchemaValue

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


# Pydantic alone would also take a number of seconds for a day.
Day = Annotated[date, BeforeValidator(_as_written)]


def _as_moment(moment: Any) -> Any:
    if isinstance(moment, str) and not re.match(r"\d{4}-\d{2}-\d{2}[Tt ]", moment, re.ASCII):
        raise ValueError("expected a moment such as 2026-11-23T10:00:09Z")
    if not isinstance(moment, str | datetime):
        raise ValueError("expected a text such as 2026-11-23T10:00:09Z")
    return moment


# Pydantic alone would also take a number of seconds for a moment.
Timestamp = Annotated[AwareDatetime, BeforeValidator(_as_moment)]


class _WrittenByAnotherVersion:
    """Validation context of documents that another version wrote."""


# Arguments for `model_validate` and `model_validate_json`: unknown fields are ignored, in nested models too, and
# unknown words are kept, see `OPEN_WORD`.
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


class _OpenWord(WrapValidator):
    """Annotation of an enumeration that newer versions may extend: in answers, clients have to expect other words."""

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        made = handler(schema)
        words = made.pop("enum", None) or [made.pop("const")] if handler.mode == "serialization" else None
        return made if words is None else {**made, "x-extensible-enum": words}


OPEN_WORD = _OpenWord(_or_a_newer_word)


@dataclass(frozen=True)
class OpenChoice:
    """Annotation of a union that newer versions may extend: in answers, clients have to expect other objects.

    `discriminator`: the member that says which object it is; `title`, `description`: of the objects to come.
    """

    discriminator: str
    title: str
    description: str

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        known = handler(schema)
        if handler.mode == "validation":
            return known
        word = {"type": "string", "description": "A word of a later version."}
        other = {"title": self.title, "description": self.description, "type": "object"}
        return {"anyOf": [known, {**other, "properties": {self.discriminator: word}, "required": [self.discriminator]}]}


class Schema(BaseModel):
    """A model of the interface: unknown fields are errors, unless a document is read `TOLERANTLY`.

    Its JSON schema is closed for what clients send, and open for answers, to which later versions may add fields.
    """

    # What an answer has is always there, at its default too.
    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_serialization_defaults_required=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        made = handler(schema)
        if handler.mode == "serialization":
            handler.resolve_ref_schema(made).pop("additionalProperties", None)
        return made


def with_example(**members: Any) -> ConfigDict:
    """Return the configuration of a model whose JSON schema has an example with these members."""
    return ConfigDict(json_schema_extra={"examples": [members]})


class Unreadable(Schema):
    """A stored entry that this version cannot read, and the reason."""

    id: str = Field(description="Id of the entry.")
    why: str = Field(
        examples=["field: the ridge must be 0 to 3 m high, not -0.001 m"], description="Reason why it cannot be read."
    )


UNREADABLE = "Entries of this page that are stored but cannot be read; absent if there are none."


def is_empty(value: object) -> bool:
    """True for a list or an object that an answer leaves out: one without entries."""
    return value in ([], {})


def is_none(value: object) -> bool:
    """True for a value that an answer leaves out: None."""
    return value is None
