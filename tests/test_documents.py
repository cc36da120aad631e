"""The documents: no placeholder left, no link that leads nowhere."""

import re
from pathlib import Path

import pytest

from service.settings import Settings
from tests.benchmarks import sizing

ROOT = Path(__file__).parents[1]
OPERATIONS = ROOT / "docker" / "README.md"
SIZING = ROOT / "docs" / "sizing.md"
DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", "models/README.md")),
    OPERATIONS,
    *sorted((ROOT / "docs").glob("*.md")),
]
# Those of the commands that call a service.
OF_CLIENTS = {"ESC_URL", "ESC_API_KEY"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_placeholder_is_left(document):
    assert not re.search(r"@[A-Z_]+@|^[A-Z]{4,}$|\bTODO\b|\bTBD\b", document.read_text(), re.MULTILINE)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(document):
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", document.read_text())
    dead = [link for link in links if "://" not in link and not (document.parent / link).exists()]
    assert dead == []


def test_the_operations_page_has_every_setting_and_no_other():
    table = OPERATIONS.read_text().partition("\n## Settings\n")[2].partition("\n## ")[0]
    documented = {
        name for row in re.findall(r"^\| (`ESC_[^|]*) \|", table, re.MULTILINE) for name in row.split("`")[1::2]
    }
    assert documented == {f"ESC_{name.upper()}" for name in Settings.model_fields}


def test_no_document_speaks_of_a_setting_that_does_not_exist():
    known = {f"ESC_{name.upper()}" for name in Settings.model_fields} | OF_CLIENTS
    for document in DOCUMENTS[2:]:
        spoken = set(re.findall(r"\bESC_[A-Z_]+[A-Z]\b", document.read_text()))
        assert spoken - known - {"ESC_DATABASE_PASSWORD"} == set()


def test_the_figures_of_the_sizing_page_are_those_that_its_command_prints():
    assert sizing.tables() in SIZING.read_text()
