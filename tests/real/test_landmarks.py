import pytest

from fields.landmarks import find
from fields.template import load


@pytest.mark.real
def test_every_clicked_point_has_a_name(real_pair):
    template, pitch = load("football"), real_pair.pitch
    size = {"length": pitch.length, "width": pitch.width, "line": pitch.line_width}
    named = {(round(x, 2), round(y, 2)) for x, y in template.places(size).values()}
    for x, y in (click["world"] for clicks in real_pair.clicks.values() for click in clicks):
        along = [f"{side} touchline, {52.5 + x:g} m from the left goal line" for side in ("near", "far")]
        on_touchlines = {tuple(round(c, 2) for c in find(name, template, size)) for name in along}
        assert (round(x, 2), round(y, 2)) in named | on_touchlines
