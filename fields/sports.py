"""Sports by the names that people type, and the templates that they mean.

A name is taken where it means one template alone. Rugby league, box lacrosse and indoor soccer are played on other
fields than the templates have; "hockey" is the one on turf, as its template is called.
"""

from __future__ import annotations

from difflib import get_close_matches

from fields.template import NAMES

OTHER_NAMES = {
    "american-football": ("gridiron", "nfl", "us football"),
    "basketball": ("basket",),
    "beach-volleyball": ("beach volley",),
    "football": ("soccer", "association football", "futbol", "fútbol", "fußball", "fussball", "calcio", "voetbal"),
    "handball": ("team handball",),
    "hockey": ("field hockey",),
    "padel": ("padel tennis",),
    "rugby-union": ("rugby", "rugby 15", "rugby fifteen"),
    "tennis": ("lawn tennis",),
    "volleyball": ("volley", "indoor volleyball"),
}
LONGEST = 40
"""Largest number of characters of a name that are compared: a stranger may send millions."""


def template_name(typed: str) -> str | None:
    """Return the name of the template that a sport's name means, or None."""
    return _TEMPLATES.get(_letters(typed)) if len(typed) <= LONGEST else None


def nearest_template_name(typed: str) -> str | None:
    """Return the name of the template whose sport is spelt most like this, or None where none is."""
    near = get_close_matches(_letters(typed[:LONGEST]), _TEMPLATES, n=1)
    return _TEMPLATES[near[0]] if near else None


def _letters(name: str) -> str:
    """Return the letters and digits of a name in small: `Ice Hockey`, `ice_hockey` and `icehockey` are one."""
    return "".join(letter for letter in name.casefold() if letter.isalnum())


_TEMPLATES = {_letters(name): name for name in NAMES} | {
    _letters(name): template for template, names in OTHER_NAMES.items() for name in names
}
