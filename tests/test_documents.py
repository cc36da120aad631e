"""The documents: no placeholder left, no link that leads nowhere."""

import re
import shlex
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import get_args

import pytest

from fields import template
from service import build
from service.schemas.names import FormatName
from service.schemas.options import Options
from service.schemas.results import CameraResult, Result
from service.settings import setting_names
from service.variable_names import unread
from tests import settings_page
from tests.e2e.commands import all_commands

ROOT = Path(__file__).parents[1]
OPERATIONS = ROOT / "docker" / "README.md"
SETTINGS = ROOT / "docs" / "settings.md"
GLOSSARY = ROOT / "docs" / "glossary.md"
INDEX = ROOT / "docs" / "README.md"
NAMES = ("README", "CHANGELOG", "CONTRIBUTING", "SECURITY", "client/README", "models/README")
DOCUMENTS = [*(ROOT / f"{name}.md" for name in NAMES), OPERATIONS, *sorted((ROOT / "docs").glob("*.md"))]
# The changelog tells what earlier versions said.
OF_TODAY = [path for path in DOCUMENTS if path.name != "CHANGELOG.md"]
INSTALL = re.compile(r"\bpip install ([^`#\n|]+)")
# Fields of calibrations that need no entry in the glossary.
EXPLAINED_BY_THEIR_NAMES = {"id", "cameras", "pictures", "callback_url", "timeout_s"}
# What others publish, and pages tell readers to install.
OF_OTHERS = {"pycolmap"}


def test_no_placeholder_is_left():
    for document in DOCUMENTS:
        assert not re.search(r"@[A-Z_]+@|^[A-Z]{4,}$|\bTODO\b|\bTBD\b", document.read_text(), re.MULTILINE), document


def test_every_relative_link_leads_somewhere():
    for document in DOCUMENTS:
        links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", document.read_text())
        dead = [link for link in links if "://" not in link and not (document.parent / link).exists()]
        assert dead == [], document


def test_every_anchor_of_a_link_is_a_heading():
    for document in DOCUMENTS:
        links = re.findall(r"\]\(([^)#:]*)#([^)]+)\)", document.read_text())
        targets = [(document.parent / path if path else document, anchor) for path, anchor in links]
        assert [anchor for target, anchor in targets if anchor not in anchors(target)] == [], document


@cache
def anchors(document):
    """What the headings of a document are called in links, as GitHub makes it of their words."""
    headings = re.findall(r"^#+ (.+)$", document.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_install_commands_name_what_a_reader_has_and_nothing_of_ours_on_an_index():
    """Anybody may claim the name of this package on PyPI, where it is not."""
    wheels = [f"{name}-{build.version()}-py3-none-any.whl" for name in ("esc_calibration", "esc_client")]
    extras = "|".join(metadata.metadata(build.PACKAGE).get_all("Provides-Extra"))
    ours = "|".join(map(re.escape, [*(f"./{wheel}" for wheel in wheels), *wheels, "./client", "."]))
    known = re.compile(rf"({ours})(\[({extras})\])?")
    for document in OF_TODAY:
        for command in INSTALL.findall(document.read_text()):
            words = iter(shlex.split(command))
            for word in words:
                if word == "-r":
                    assert (document.parent / next(words)).is_file(), (document, command)
                elif not word.startswith("-"):
                    assert known.fullmatch(word) or word in OF_OTHERS, (document, command)


def test_every_target_of_make_that_a_document_names_is_one():
    targets = set(re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for document in DOCUMENTS:
        named = re.findall(r"\bmake ([a-z]+(?:-[a-z]+)*)`", document.read_text())
        called = re.findall(r"^make ([a-z]+(?:-[a-z]+)*)", document.read_text(), re.MULTILINE)
        assert {*named, *called} <= targets, document


def test_every_command_of_esc_that_a_document_shows_has_the_options_it_shows():
    # The options of every command, by the words that call it.
    commands = {
        words: {option for parameter in command.params for option in parameter.opts} | {"--help"}
        for words, command in all_commands()
        if not hasattr(command, "commands")
    }
    for document in OF_TODAY:
        blocks = re.findall(r"^```(?:sh|console)\n(.*?)^```", document.read_text(), re.DOTALL | re.MULTILINE)
        for line in "".join(blocks).replace("\\\n", " ").splitlines():
            called = re.search(r"(?:^|[ /])esc ((?:[a-z]+ ?)+)(.*)", line.partition(" # ")[0])
            if called is None:
                continue
            name = max((name for name in commands if called[1].startswith(name)), key=len, default=None)
            assert name, (document, line)
            options = set(re.findall(r"(?<=\s)(--[a-z][a-z-]+)", called[2].partition("|")[0]))
            assert options <= commands[name], (document, line)


def test_the_page_of_the_settings_is_that_of_the_code():
    assert SETTINGS.read_text().endswith(settings_page.tables() + "\n")


def test_no_document_and_no_file_of_operators_speaks_of_a_variable_that_a_start_would_refuse():
    files = [path for path in (ROOT / "docker").rglob("*") if path.is_file()]
    for document in [*OF_TODAY, *files, ROOT / ".ci" / "run"]:
        spoken = set(re.findall(r"\bESC_[A-Z_]+[A-Z]\b", document.read_text()))
        assert unread(spoken, setting_names()) == [], document


def test_the_index_lists_every_page():
    linked = set(re.findall(r"\]\(([a-z-]+\.md)\)", INDEX.read_text()))
    assert linked == {path.name for path in (ROOT / "docs").glob("*.md")} - {INDEX.name}


def test_the_readme_counts_sports_and_formats_as_they_are():
    readme = (ROOT / "README.md").read_text()
    numbers = ("fourteen", "fifteen", "sixteen", "seventeen", "eighteen")
    counted = {"sports": len(template.NAMES), "formats": len(get_args(FormatName))}
    assert [f"[{numbers[count - 14]} {what}]" in readme for what, count in counted.items()] == [True, True]


def glossary_entries():
    return re.findall(r"^- \*\*(.+?)\*\*: .", GLOSSARY.read_text(), re.MULTILINE)


def test_the_glossary_is_in_alphabetical_order():
    entries = [re.sub(r"[`,]", "", entry).lower() for entry in glossary_entries()]
    assert entries == sorted(entries)


@pytest.mark.parametrize("model", [CameraResult, Result, Options])
def test_the_glossary_explains_every_field_of_calibrations(model):
    words = set(re.findall(r"`(\w+)`", GLOSSARY.read_text()))
    assert set(model.model_fields) - EXPLAINED_BY_THEIR_NAMES <= words
