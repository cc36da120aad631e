"""The check of prose finds what is planted, and nothing in the documents as they are."""

import pytest

from tests.prose.__main__ import banned_words, documents, findings_in_document, findings_in_message

WORDS = banned_words()
DOCUMENTS = dict(documents())
LONG = " ".join(["word"] * 36) + "."


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_document_has_short_sentences_of_good_words(name):
    assert list(findings_in_document(DOCUMENTS[name], WORDS)) == []


@pytest.mark.parametrize(
    ("planted", "finding"),
    [
        (LONG, "36 words, at most 35: word word"),
        ("An alarm rings at night.", "alarm rings: better fires, is active"),
        ("| the color of the paint |", "color: better colour"),
        ("It is recognized by its lines.", "recognized: better -ise"),
        ("- Utilize the page in order to see more.", "in order to: better to"),
    ],
)
def test_an_offence_that_is_planted_in_a_document_is_found(planted, finding):
    document = DOCUMENTS["docs/drift.md"]
    assert any(finding in one for one in findings_in_document(f"{document}\n\n{planted}\n", WORDS))


def test_code_links_and_tables_are_not_prose():
    kept = f"`color: 1` and [a page](center.md)\n\n```sh\ncolor {LONG}\n```\n\n| {LONG} |\n"
    assert list(findings_in_document(kept, WORDS)) == []


def test_messages_are_checked_and_names_are_not():
    said = f"the camera was told of it; {LONG}"
    assert [one.partition(":")[0] for one in findings_in_message(said, WORDS)] == ["told", "36 words, at most 35"]
    assert list(findings_in_message("color center", WORDS)) == []
