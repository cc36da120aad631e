"""Every event is told everywhere: by its kind, to the page, to clients, in the document."""

import re
from pathlib import Path

import pytest

from service.schemas.events.venue_event import EVENT_MODELS, EVENT_TYPES, matches_kinds
from service.schemas.names import EVENT_KINDS

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "service" / "pages" / "static" / "follow.js").read_text()
CLIENT = (ROOT / "client" / "esc_client" / "__init__.py").read_text()
DOCUMENT = (ROOT / "docs" / "events.md").read_text()
# Every stream begins with it, whatever was asked for.
BEGINNING = "poses.current"


@pytest.mark.parametrize("event", sorted(EVENT_TYPES - {BEGINNING}))
def test_every_event_is_of_one_kind(event):
    assert sum(matches_kinds(event, [kind]) for kind in EVENT_KINDS) == 1


def test_the_page_follows_every_event():
    (kinds,) = re.findall(r"const KINDS = \[(.*?)\]", PAGE, re.DOTALL)
    assert sorted(re.findall(r'"(.+?)"', kinds)) == sorted(EVENT_TYPES)


def test_the_document_has_a_row_for_every_event_and_names_every_kind():
    rows = re.findall(r"^\| (`[a-z]+\.[a-z]+`(?:, `[a-z]+\.[a-z]+`)*) \|", DOCUMENT, re.MULTILINE)
    assert sorted(re.findall(r"`(.+?)`", ", ".join(rows))) == sorted(EVENT_TYPES)
    (kinds,) = re.findall(r"chooses kinds: (.+?);", DOCUMENT)
    assert re.findall(r"`(.+?)`", kinds) == list(EVENT_KINDS)


def test_the_client_has_the_model_of_every_event():
    (exported,) = re.findall(r"__all__ = \[(.*?)\]", CLIENT, re.DOTALL)
    assert {model.__name__ for model in EVENT_MODELS} <= set(re.findall(r'"(.+?)"', exported))
