"""The tables of docs/settings.md: printed by `python -m tests.settings_page` from the fields of `service.settings`."""

from __future__ import annotations

import json
import types
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from service.settings import MODEL_BESIDE_THE_CODE, Settings

# The heading of each part of the page, by its first setting.
HEADINGS = {
    "data": "Where things live",
    "host": "Listening, keys and rates",
    "max_body_mb": "What clients may send",
    "sources": "Frames that the service fetches",
    "freed_axes": "Poses in other formats",
    "picture_program": "Pictures and stitched views",
    "worker_name": "The worker",
    "keep_frames_days": "What is kept, and how long",
    "webhook_secret": "Callbacks and webhooks",
    "log_format": "Logs and metrics",
}
# Defaults that differ from machine to machine.
OF_THE_MACHINE = {"worker_name": "the host's name", "threads": "the cores that it may use"}
BOUNDS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}


def tables() -> str:
    """Return a Markdown table of variable, type, default and meaning for each heading, in the order of the fields."""
    lines: list[str] = []
    for name, field in Settings.model_fields.items():
        if name in HEADINGS:
            lines += ["", f"## {HEADINGS[name]}", "", "| variable | type | default | meaning |", "|---|---|---|---|"]
        assert field.description, f"{name} has no description"
        meaning = field.description.replace("|", "\\|")
        lines.append(f"| `ESC_{name.upper()}` | {_type(field)} | {_default(name, field)} | {meaning} |")
    return "\n".join(lines[1:])


def _type(field: FieldInfo) -> str:
    """Return the type of a setting with its bounds: `number > 0`, `json or console`, `JSON list`."""
    bounds = [f"{sign} {value}" for sign, value in _bounds(field)]
    return " ".join([_type_name(field.annotation), ", ".join(bounds)]).strip()


def _bounds(field: FieldInfo) -> list[tuple[str, Any]]:
    return [
        (sign, getattr(constraint, name))
        for constraint in field.metadata
        for name, sign in BOUNDS.items()
        if hasattr(constraint, name)
    ]


def _type_name(annotation: Any) -> str:
    if get_origin(annotation) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(annotation))
    if get_origin(annotation) in (Union, types.UnionType):
        (annotation,) = (one for one in get_args(annotation) if one is not type(None))
    if get_origin(annotation) is list:
        return "JSON list"
    names = {int: "integer", float: "number", bool: "boolean", Path: "path"}
    return names.get(annotation, "text")


def _default(name: str, field: FieldInfo) -> str:
    if name in OF_THE_MACHINE:
        return OF_THE_MACHINE[name]
    match field.default:
        case None | [] | "":
            return "none"
        case bool():
            return f"`{str(field.default).lower()}`"
        case list():
            # The interpreter that runs the service.
            return f"`{json.dumps(['python', *field.default[1:]])}`"
        case Path() as path if path == MODEL_BESIDE_THE_CODE:
            return f"`{path.relative_to(path.parents[1])}`"
        case _:
            return f"`{field.default}`"


if __name__ == "__main__":
    print(tables())
