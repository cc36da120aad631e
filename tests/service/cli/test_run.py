"""`esc run`: the pictures that it is asked for."""

import pytest

from service.cli.run import _names_of as names_of
from service.store.jobs.files import names_of_all

CAMERAS = ["left", "right"]


@pytest.mark.parametrize(
    ("kinds", "names"),
    [
        ("none", []),
        ("preview,overlay", ["preview", "overlay_left", "overlay_right"]),
        ("new,birdseye", ["birdseye", "new_left", "new_right"]),
        ("all", names_of_all(CAMERAS)),
    ],
)
def test_pictures_are_named_by_their_kind(kinds, names):
    assert names_of(kinds, CAMERAS) == names


def test_an_unknown_kind_is_refused_with_those_there_are(capsys):
    with pytest.raises(SystemExit) as ended:
        names_of("preview,thumbnail", CAMERAS)
    assert ended.value.code == 2
    assert "--pictures thumbnail: expected all, none, or some of preview, preview_before" in capsys.readouterr().err
