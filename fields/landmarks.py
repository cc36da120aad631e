"""Points of a field by the names that people give them: `Left penalty area, near corner`."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping

from fields.shapes import Point
from fields.template import Template

NUMBER = re.compile(r"\d+(?:\.\d+)?")
SUGGESTED = 3
# Likeness of two words, 0..1, from which the one is the other misspelt.
MISSPELT = 0.8


class UnknownLandmark(ValueError):  # noqa: N818
    """Raised when no point of the field has this name; `near` are similar names."""

    def __init__(self, name: str, near: list[str]) -> None:
        super().__init__(f"no point is called {name!r}" + (f"; near it: {'; '.join(near)}" if near else ""))
        self.name = name
        self.near = near


def find(name: str, template: Template, size: Mapping[str, float]) -> Point:
    """Return the place of a named point, whatever the case, spaces and punctuation; raises `UnknownLandmark`.

    A name such as `near touchline, 22 m from the left goal line` may have any number.
    """
    places = {_plain(known): (known, point) for known, point in template.places(size).items()}
    wanted = _plain(name)
    if wanted in places:
        return places[wanted][1]
    number = NUMBER.search(wanted)
    open_names = {_plain(known): known for known in template.places_at(size, 0.0)}
    if number is not None:
        open_name = open_names.get(f"{wanted[: number.start()]}distance{wanted[number.end() :]}")
        if open_name is not None:
            return template.places_at(size, float(number.group()))[open_name]
    raise UnknownLandmark(name, _like(wanted, {plain: known for plain, (known, _) in places.items()} | open_names))


def _like(wanted: str, names: Mapping[str, str]) -> list[str]:
    """Return the names, by how they are compared, that are spelt like `wanted`, or else that have most of its words."""
    near = difflib.get_close_matches(wanted, names, SUGGESTED)
    if not near:
        shared = {plain: _words_shared(wanted.split(), plain.split()) for plain in names}
        most = max(shared.values(), default=0)
        near = [plain for plain, count in shared.items() if count == most > 0][:SUGGESTED]
    return [names[plain] for plain in near]


def _words_shared(wanted: list[str], name: list[str]) -> int:
    return sum(bool(difflib.get_close_matches(word, name, 1, MISSPELT)) for word in wanted)


def _plain(name: str) -> str:
    """Return a name in small letters, digits and single spaces, with `centre` for `center`."""
    words = re.findall(r"\d+\.\d+|[^\W_]+", name.casefold())
    return " ".join("centre" if word == "center" else word for word in words)
