"""What a schema found wrong with a document, in words that name the part as whoever wrote it does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel

Place = tuple[str | int, ...]
LONGEST_SHOWN = 40
LONGEST_NAME = 64
MOST_MEANT = 20
"""So many misspelt names are looked up: that of all in a document made for it would take the service minutes."""

EXPECTED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "text",
    "list_type": "a list",
    "dict_type": "an object",
    "model_type": "an object",
    "model_attributes_type": "an object",
    "literal_error": "{expected}",
    "greater_than": "more than {gt}",
    "greater_than_equal": "{ge} or more",
    "less_than": "less than {lt}",
    "less_than_equal": "{le} or less",
}
"""By the kinds of pydantic, with what it says of each."""
EXPECTED_LENGTH = {
    "too_short": "at least {min_length} entries, came {actual_length}",
    "too_long": "at most {max_length} entries, came {actual_length}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
    "string_pattern_mismatch": "text of the pattern {pattern}",
}
"""What came is too long to be shown, or a secret."""


def in_words(findings: Sequence[Mapping[str, Any]], model: Any, document: Any) -> list[str]:
    """Each of pydantic's errors. `model`: the type that the `document` should have had; None: not known."""
    unknown = [finding["loc"] for finding in findings if finding["type"] == "extra_forbidden"]
    meant = {place: _meant(place, model) for place in unknown[:MOST_MEANT]}
    return [_in_words(finding, _named(finding["loc"], document), meant) for finding in findings]


def _in_words(finding: Mapping[str, Any], place: str, meant: Mapping[Place, str]) -> str:
    match finding["type"]:
        case "missing":
            return f"{place} is missing"
        case "extra_forbidden":
            return f"{place} is not known{meant.get(finding['loc'], '')}"
        case kind if kind in EXPECTED:
            expected = EXPECTED[kind].format(**finding.get("ctx", {}))
            said = f"expected {expected}, came {_shown(finding['input'])}"
        case kind if kind in EXPECTED_LENGTH:
            said = f"expected {EXPECTED_LENGTH[kind].format(**finding['ctx'])}"
        case _:
            said = finding["msg"].removeprefix("Value error, ")
    return f"{place}: {said}" if place else said


def _named(place: Place, document: Any) -> str:
    """Where something is, with the ids of what has one, and nothing of how the schema came there."""
    steps = []
    for number, step in enumerate(place, start=1):
        inside = _part(document, step)
        if inside is None and document is not None and number < len(place):
            continue
        steps.append(str(inside["id"] if isinstance(step, int) and _has_id(inside) else step))
        document = inside
    return ".".join(steps)


def _part(document: Any, step: str | int) -> Any:
    if isinstance(document, dict):
        return document.get(step)
    if isinstance(document, list) and isinstance(step, int) and step < len(document):
        return document[step]
    return None


def _has_id(document: Any) -> bool:
    name = document.get("id") if isinstance(document, dict) else None
    return isinstance(name, str) and len(name) <= LONGEST_NAME


def _meant(place: Place, model: Any) -> str:
    """The field that was most likely meant, or else all that there are."""
    *way, wrong = place
    models = _models(model)
    for step in way:
        fields = [found.model_fields[step] for found in models if isinstance(step, str) and step in found.model_fields]
        if fields:
            models = [inner for field in fields for inner in _models(field.annotation)]
    known = list(dict.fromkeys(field.alias or name for found in models for name, field in found.model_fields.items()))
    near = get_close_matches(str(wrong)[:LONGEST_NAME], known, n=1)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known are {', '.join(known)}" if known else ""


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models that something of this type may be, or be made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        root = annotation.model_fields.get("root")
        return [annotation] if root is None else _models(root.annotation)
    return [model for inner in get_args(annotation) for model in _models(inner)]


def _shown(value: Any) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str() | int() | float():
            shown = repr(value)
            return shown if len(shown) <= LONGEST_SHOWN else f"{shown[:LONGEST_SHOWN]}..."
        case list():
            return "a list"
        case dict():
            return "an object"
        case _:
            return f"a {type(value).__name__}"
