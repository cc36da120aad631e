"""Validation errors of pydantic in words for people who write documents."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel

from fields.shapes import COLOUR_PATTERN, COLOURS
from service.schemas.base import NAME_PATTERN
from service.schemas.names import ID_IN_WORDS, ID_PATTERN, JOB_ID_PATTERN, id_like
from service.schemas.options import CHARUCO_PATTERN

Location = tuple[str | int, ...]
MAX_PREVIEW_LENGTH = 40
MAX_NAME_LENGTH = 64
MAX_SUGGESTIONS = 20
"""Most misspelt names that are looked up: a malicious document with thousands would take minutes."""

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
    "greater_than": "more than {gt:g}{unit}",
    "greater_than_equal": "{ge:g}{unit} or more",
    "less_than": "less than {lt:g}{unit}",
    "less_than_equal": "{le:g}{unit} or less",
    "url_parsing": "an address such as https://host.example/path",
    "url_scheme": "an address that begins with {expected_schemes}",
}
"""Expected values by pydantic's error types; fields come from the error's context."""
UNITS = {
    "_m": " m",
    "_px": " px",
    "_deg": "°",
    "_s": " s",
    "_h": " h",
    "_hours": " hours",
    "_days": " days",
    "_years": " years",
    "_mb": " MB",
    "_cm": " cm",
    "rotation": " rad",
    "position": " m",
    "translation": " m",
}
"""Units by the ends of field names."""
EXPECTED_PATTERN = {
    ID_PATTERN: f"an id, {ID_IN_WORDS}",
    JOB_ID_PATTERN: "the id of a job, 26 capital letters and digits",
    NAME_PATTERN: "text without control characters",
    COLOUR_PATTERN: f"{', '.join(COLOURS)} or #rrggbb",
    CHARUCO_PATTERN: "the name of a dictionary of OpenCV, such as 4X4_50",
}
"""Descriptions of the schemas' regular expressions."""
EXPECTED_LENGTH = {
    "too_short": "at least {min_length} entries, came {actual_length}",
    "too_long": "at most {max_length} entries, came {actual_length}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
}
"""Expected lengths by error type. The value is not repeated: it is long, or a secret."""
NOT_METRES = "it is in metres: are these centimetres or millimetres?"
OTHER_UNITS = {
    "rotation": "it is a Rodrigues vector in radians, and these look like degrees",
    "position": NOT_METRES,
    "translation": NOT_METRES,
}
"""Hints by vector name, for a component beyond its limits."""


def describe_errors(findings: Sequence[Mapping[str, Any]], model: Any, document: Any) -> list[str]:
    """Return a sentence for each of pydantic's errors. `model`: the expected type of `document`; None if unknown."""
    unknown = [finding["loc"] for finding in findings if finding["type"] == "extra_forbidden"]
    meant = {place: _suggestion(place, model) for place in unknown[:MAX_SUGGESTIONS]}
    return [_describe_error(finding, _path_with_ids(finding["loc"], document), meant) for finding in findings]


def _describe_error(finding: Mapping[str, Any], place: str, meant: Mapping[Location, str]) -> str:
    match finding["type"]:
        case "missing":
            return f"{place} is missing"
        case "extra_forbidden":
            return f"{place} is not known{meant.get(finding['loc'], '')}"
        case kind if kind in EXPECTED:
            expected = EXPECTED[kind].format(unit=_unit(finding["loc"]), **finding.get("ctx", {}))
            said = f"expected {expected}, came {_preview(finding['input'])}{_other_unit(finding)}"
        case kind if kind in EXPECTED_LENGTH:
            said = f"expected {EXPECTED_LENGTH[kind].format(**finding['ctx'])}"
        case "string_pattern_mismatch":
            said = _described_pattern(finding["ctx"]["pattern"], finding["input"])
        case _:
            said = finding["msg"].removeprefix("Value error, ")
    return f"{place}: {said}" if place else said


def _described_pattern(pattern: str, given: str) -> str:
    words = f"expected {EXPECTED_PATTERN.get(pattern, f'text of the pattern {pattern}')}, came {_preview(given)}"
    proposed = id_like(given[:MAX_NAME_LENGTH]) if pattern == ID_PATTERN else ""
    return f"{words}; {proposed} would do" if proposed else words


def _unit(place: Location) -> str:
    """Return the unit of a number by the name of its field; empty without one."""
    name = next((step for step in reversed(place) if isinstance(step, str)), "")
    return next((unit for end, unit in UNITS.items() if name.endswith(end)), "")


def _other_unit(finding: Mapping[str, Any]) -> str:
    """Return a hint at the wrong unit that a number beyond its limits was probably written in."""
    if finding["type"] not in ("less_than_equal", "greater_than_equal"):
        return ""
    of = [OTHER_UNITS[step] for step in finding["loc"] if step in OTHER_UNITS]
    if not of and finding["type"] == "less_than_equal" and _unit(finding["loc"]) == " m":
        of = [NOT_METRES]
    return f"; {of[-1]}" if of else ""


def _path_with_ids(place: Location, document: Any) -> str:
    """Return the path of an error in the document, with ids in place of list indices and without union tags."""
    steps = []
    for number, step in enumerate(place, start=1):
        inside = _member(document, step)
        is_last = number == len(place)
        if inside is None and document is not None and not (is_last and isinstance(document, dict | list)):
            continue
        steps.append(str(inside["id"] if isinstance(step, int) and _has_id(inside) else step))
        document = inside
    return ".".join(steps)


def _member(document: Any, step: str | int) -> Any:
    if isinstance(document, dict):
        return document.get(step)
    if isinstance(document, list) and isinstance(step, int) and step < len(document):
        return document[step]
    return None


def _has_id(document: Any) -> bool:
    name = document.get("id") if isinstance(document, dict) else None
    return isinstance(name, str) and len(name) <= MAX_NAME_LENGTH


def _suggestion(place: Location, model: Any) -> str:
    """Return the field that a misspelt name is closest to, or else all known fields."""
    *way, wrong = place
    models = _models(model)
    for step in way:
        fields = [found.model_fields[step] for found in models if isinstance(step, str) and step in found.model_fields]
        if fields:
            models = [inner for field in fields for inner in _models(field.annotation)]
    known = list(dict.fromkeys(field.alias or name for found in models for name, field in found.model_fields.items()))
    near = get_close_matches(str(wrong)[:MAX_NAME_LENGTH], known, n=1)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known are {', '.join(known)}" if known else ""


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        root = annotation.model_fields.get("root")
        return [annotation] if root is None else _models(root.annotation)
    return [model for inner in get_args(annotation) for model in _models(inner)]


def _preview(value: Any) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str() | int() | float():
            shown = repr(value)
            return shown if len(shown) <= MAX_PREVIEW_LENGTH else f"{shown[:MAX_PREVIEW_LENGTH]}..."
        case list():
            return "a list"
        case dict():
            return "an object"
        case _:
            return f"a {type(value).__name__}"
