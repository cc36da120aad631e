"""Every format is complete: it has what writes it, a media type that the interface documents, a row and a name."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest

from service.formats.table import OneCameraFormat, export_formats
from service.pages.page_rendering import templates
from service.routes.contract.exported import DOCUMENTS
from service.schemas.names import FormatName
from service.settings import Settings

NAMES = get_args(FormatName)
FORMATS = export_formats(Settings())
DOCUMENT = (Path(__file__).parents[3] / "docs" / "formats.md").read_text()


def test_every_name_of_a_format_has_what_writes_it():
    assert set(FORMATS) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_format_has_a_row_in_its_document(name):
    assert re.search(rf"^\| `{name}` \|", DOCUMENT, re.MULTILINE)


@pytest.mark.parametrize("name", NAMES)
def test_the_interface_documents_the_media_type_of_every_format(name):
    assert FORMATS[name].media_type in DOCUMENTS[200]["content"]


@pytest.mark.parametrize("name", NAMES)
def test_the_page_names_every_format_and_offers_all_cameras_where_one_file_has_them(name):
    page = templates.get_template("parts.html").module.downloads("/venues/demo/poses", [name], [], "Poses")
    (title,) = re.findall(r'<th scope="row">(.+?)</th>', page)
    assert title
    assert ("Download" in page) is not isinstance(FORMATS[name], OneCameraFormat)


@pytest.mark.parametrize("made", [True, False])
def test_a_page_offers_st_maps_only_where_openexr_is_installed(made, monkeypatch):
    monkeypatch.setitem(templates.globals, "makes_st_maps", made)
    parts = templates.overlay(cache_size=0).get_template("parts.html").module
    row = parts.downloads("/venues/demo/poses", ["st-map"], [SimpleNamespace(id="left")], "Poses")
    assert ("format=st-map&amp;camera=left" in row) is made
    assert ("needs OpenEXR, which is not installed here" in row) is not made
