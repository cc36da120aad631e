"""Edits of a venue by hand, as merge patches (RFC 7396)."""

import pytest

from service.cli.venue_edits import merge_patch_between


@pytest.mark.parametrize(
    ("before", "after", "patch"),
    [
        ({"name": "a", "alarms": {}}, {"name": "a"}, {"alarms": None}),
        ({"name": "a", "b": {"c": 1, "d": 2}}, {"name": "a", "b": {"c": 1, "d": 3}}, {"b": {"d": 3}}),
        ([{"id": "left", "x": 1}, {"id": "right"}], [{"id": "left", "x": 2}], {"left": {"x": 2}, "right": None}),
    ],
)
def test_a_patch_holds_what_was_changed_and_what_was_removed(before, after, patch):
    assert merge_patch_between(before, after) == patch
