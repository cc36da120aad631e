"""The map of the code is that of the code."""

import re

import pytest

from tests import architecture

MAP = (architecture.ROOT / "docs" / "architecture.md").read_text()


def test_the_rooms_of_the_map_are_those_of_the_import_contracts():
    assert architecture.tables() in MAP


def test_every_room_of_the_code_has_a_place_in_the_contracts():
    for place in architecture.PLACES:
        folder = architecture.ROOT / place.replace(".", "/")
        rooms = {path.stem for path in folder.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
        named = {room for row in architecture.layers(place) for room in row}
        assert rooms - named - {"__init__", "__main__", "__pycache__"} == set()


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:service|worker|fields|tests)/[\w/.-]*)`", MAP))))
def test_every_file_that_the_map_names_is_there(path):
    assert (architecture.ROOT / path).exists()
